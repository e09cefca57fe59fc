"""What to do now in the laboratory, in one sentence, and the words of a verdict; from typed results alone."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from addb_viewer.text.amounts import counted
from addb_viewer.text.diagnosis_vocabulary import (
    CONFIDENT,
    about,
    capital,
    listed,
    names_of,
    short_title,
    target_in_words,
    tentative_of,
)
from addb_viewer.text.direct_check_words import ABOUT
from addb_viewer.text.residual_words import corrected_on_reading
from addb_viewer.trial_view.trial_verdict import trial_verdict
from addb_viewer.watch.judging import FirstLook, FitLook, Look, Step
from addb_viewer.watch.verdict_log import Colour, VerdictLine
from solver.capture.capture import PlanItem
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.diagnosis.direct_checks.statement import STATED_NATS
from solver.diagnosis.direct_checks.statement import About as Class
from solver.fitting.verdict import Use, Why

NOTHING = "Nothing to repeat"
STATIC = "static taken"
COLOURS = {"✓": Colour.GREEN, "!": Colour.YELLOW, "✗": Colour.RED, "–": Colour.RED}
SIGNS = {Colour.GREEN: "✓", Colour.YELLOW: "!", Colour.RED: "✗", Colour.NONE: "–"}

BY_BRANCH = {  # of the catalogue of causes
    "time/clock": "check the trigger between cameras and plates, then repeat",
    "time/clock of each trial": "start cameras and plates by one trigger, then repeat",
    "time/clock of one plate": "check this plate's amplifier and trigger, then repeat",
    "time/rate": "check the rates of plates and cameras in the recording program, then repeat",
    "time/filter": "export the forces unfiltered; nothing to repeat",
    "plate/scale": "check the plate's units and range with a known weight",
    "plate/zero": "tare with nobody on it and repeat",
    "plate/geometry": "measure the corners of the plates again; nothing to repeat",
    "plate/channels": "check cables and channels of the plates; nothing to repeat",
    "ground/belt or platform": "record the speed and the slope of the belt",
    "ground/object on a plate": "take it off and repeat",
    "ground/missed step": "repeat with every step on a plate",
    "on the person/touch": "keep it away and repeat",
    "on the person/steady": "record its force, or take it off and repeat",
    "on the person/with motion": "record its force, or take it off and repeat",
    "on the person/load": "weigh it and note where it was fixed; nothing to repeat",
    "body/whole mass": "weigh the person with everything they wear; nothing to repeat",
    "body/one segment": "nothing to repeat",
    "body/soft_tissue": "nothing to repeat",
    "markers/scale of the cameras": "calibrate the cameras again, then repeat",
    "markers/one": "check the marker and its label, then a static trial, then repeat",
    "markers/several at once": "fix them anew, then a static trial, then repeat",
}
BY_CHECK: Mapping[Class, str] = {
    Class.ENTERED_MASS: "weigh the person with everything they wear",
    Class.LOAD: "take it off",
    Class.OFF_PLATE: "look whether every step was on a plate",
    Class.CLOCK: "check the trigger between cameras and plates",
    Class.FILTER: "export the forces unfiltered",
    Class.PLATE_SIGN: "check the sign of the plate's channels",
    Class.PLATE_ZERO: "tare with nobody on it",
    Class.PLATE_SCALE: "check the plate's units and range",
    Class.PLATE_PLACE: "measure the corners of the plate again",
    Class.PLATE_TURN: "check the order of the plate's corners",
    Class.SLIP: "look whether it still sits where it was",
    Class.SEGMENT: "look for cloth or a strap that was caught",
}
BY_REASON = {
    Why.NO_POSE: "Repeat: too few markers were seen",
    Why.NO_FRAMES: "Repeat: on no frame every foot was on a plate",
    Why.MARKERS: "Look at the labels and the static trial, then repeat",
    Why.MOMENT: "Keep it and record one more: forces and motion disagree, and no cause is named",
    Why.FORCE: "Keep it and record one more: forces and motion disagree, and no cause is named",
    Why.UNEXPLAINED: "Keep it and record one more: something is wrong that has no name",
    Why.MARKER: f"{NOTHING}; look at one marker",
    Why.NO_FORCES: f"{NOTHING}, if no plates were to be recorded",
}
OFF_PLATE = "ground/missed step"  # the branch
MOST_NAMED = 3  # markers in a sentence


class Told(NamedTuple):
    """A verdict in words."""

    colour: Colour
    words: str
    to_do: str


def first_told(found: FirstLook, former_off_zero: Sequence[Sequence[str]]) -> Told:
    """Of the first look.

    Args:
        found: by it.
        former_off_zero: of the trials before, the last ones last, the plates whose zero level was off.
    """
    acts = [*_zero(found.look, former_off_zero), *_no_load(found.look)]
    if found.unborne_s and not acts:
        at = listed([f"{time:.1f} s" for time in found.unborne_s[:MOST_NAMED]])
        acts.append(f"May have to be repeated: a step may have missed the plates at {at}")
    for one in sorted(found.statements, key=lambda one: -one.loudest):
        acts += [_of_check(kind, one.target) for kind in one.spoken_for(STATED_NATS)[:1]]
    lost = [f"{capital(_lost(found.look))}"] if found.look.lost else []
    told = [*dict.fromkeys(acts), *lost]
    words = "First look: something to look at" if told else "First look: nothing found"
    return Told(Colour.YELLOW if told else Colour.NONE, words, told[0] if told else "Wait for the verdict")


def told(
    fit: FitLook,
    report: DiagnosisReport | None,
    former_off_zero: Sequence[Sequence[str]],
    *,
    is_last: bool = True,
) -> Told:
    """Of the fit, and of the diagnosis where there is one.

    Args:
        fit: of the trial.
        report: of its diagnosis; None: there is none, or not yet.
        former_off_zero: as in `first_told`.
        is_last: the diagnosis is not to come any more, and may take back what the fit alone would ask for.
    """
    found = trial_verdict(fit.figures, None, report)
    named = [] if report is None else [c for c in names_of(report) if not corrected_on_reading(c)]
    line, acts = found.line, list(_acts(fit, named, former_off_zero))
    colour = COLOURS[line.sign]
    if acts and colour is Colour.GREEN:
        colour = Colour.YELLOW
    words = " · ".join(filter(None, (", ".join(filter(None, (line.use, line.band))), line.frames, line.why)))
    acts += _beyond_plates(fit, named)
    if report is not None and found.verdict.reasons:
        loud = (one for one in report.direct_checks if one.speaks_for)
        acts += [_of_check(Class(one.speaks_for[0]), one.target) for one in loud]
    acts += [BY_REASON[r.why] for r in found.verdict.reasons if r.why in BY_REASON and is_last]
    tentative = [] if report is None else tentative_of(report)
    acts += [f"{NOTHING}; a weak sign of {short_title(cause)}" for cause in tentative]
    acts += [f"{NOTHING}; {_lost(fit.look)}"] if fit.look.lost else []
    return Told(colour, words, [*acts, NOTHING if is_last else "Wait for the diagnosis"][0])


def broken_told(reason: str) -> Told:
    """Of a trial that cannot be read or fitted."""
    return Told(Colour.RED, "Not usable · cannot be judged", f"Export it again, or repeat: {reason}")


def is_good(fit: FitLook, report: DiagnosisReport | None) -> bool:
    """Whether the plan counts it: its torques can be used, and its plates were tared."""
    return trial_verdict(fit.figures, None, report).verdict.use is Use.TORQUES and not fit.look.off_zero


def _acts(fit: FitLook, named: Sequence[Cause], former: Sequence[Sequence[str]]) -> Iterator[str]:
    """What is to be done, the most urgent first."""
    yield from _zero(fit.look, former)
    yield from _no_load(fit.look)
    off_plate = _off_plate(fit, named)
    missed = [step for step in fit.steps if step.missed]
    missed += [step for step in off_plate if step not in missed and _is_amid(step, fit.steps)]
    if missed:
        sure = missed[0].missed or any(c.confidence >= CONFIDENT for c in named if _is_off_plate(c))
        begin, has = ("Repeat", "missed") if sure else ("May have to be repeated", "may have missed")
        yield f"{begin}: {listed([_missed(step, has) for step in missed[:MOST_NAMED]])}"
    yield from (_of_cause(cause) for cause in named if not (off_plate and _is_off_plate(cause)))


def _off_plate(fit: FitLook, named: Sequence[Cause]) -> list[Step]:
    """Steps of which the diagnosis says that no plate measured them."""
    causes = [cause for cause in named if _is_off_plate(cause)]
    return [step for step in fit.steps if any(_is_of(cause, step) for cause in causes)]


def _is_off_plate(cause: Cause) -> bool:
    return about(cause).branch == OFF_PLATE


def _beyond_plates(fit: FitLook, named: Sequence[Cause]) -> Iterator[str]:
    """Steps on the way to the plates, or from them: whether they should be on one nobody has said."""
    steps = [step for step in _off_plate(fit, named) if not _is_amid(step, fit.steps)]
    if steps:
        told = listed([f"step {step.number}" for step in steps[:MOST_NAMED]])
        yield f"{NOTHING}, unless {told} {'was' if len(steps) == 1 else 'were'} to be on a plate"


def _of_check(kind: Class, target: str | None) -> str:
    what = f" ({target_in_words(target)})" if target else ""
    return f"May be {ABOUT[kind]}{what}: {BY_CHECK[kind]}"


def _of_cause(cause: Cause) -> str:
    sure = cause.confidence >= CONFIDENT
    act = BY_BRANCH.get(about(cause).branch, "look at the diagnosis")
    return f"{capital(short_title(cause)) if sure else f'May be {short_title(cause)}'}: {act}"


def _is_of(cause: Cause, step: Step) -> bool:
    """Whether most of a stretch of a cause's frames is a step's, of the same foot."""
    first, end = step.frames
    shared = [(min(b, end) - max(a, first), b - a) for _, a, b in cause.frames]
    return cause.target.endswith("_r") == (step.side == "Right") and any(2 * own > all for own, all in shared)


def _is_amid(step: Step, steps: Sequence[Step]) -> bool:
    whole = [one.number for one in steps if one.whole]
    return bool(whole) and whole[0] < step.number < whole[-1]


def _missed(step: Step, has: str) -> str:
    return f"step {step.number} {has} {f'plate {step.plate}' if step.plate else 'the plates'}"


def _zero(look: Look, former: Sequence[Sequence[str]]) -> Iterator[str]:
    """Plates that do not read zero while empty: less than nothing where a load was on them at taring."""
    for plate, level_N in look.off_zero:
        since = 1
        for plates in reversed(former):
            if f"plate_{plate}" not in plates:
                break
            since += 1
        trials = "this trial" if since == 1 else f"the last {counted(since, 'trial')}"
        why = "a load at taring" if level_N < 0 else "no taring"
        yield f"Plate {plate} reads {level_N:+.0f}\u00a0N while empty, may be {why}: tare and repeat {trials}"


def _no_load(look: Look) -> Iterator[str]:
    if look.has_plates and not look.is_loaded:
        yield "Repeat: no plate bore a load; were the amplifiers on?"


def _lost(look: Look) -> str:
    (name, seconds), more = look.lost[0], len(look.lost) - 1
    others = f", {counted(more, 'other')} as well" if more else ""
    return f"marker {name} was lost for {seconds:.1f} s{others}"


def plan_words(plan: Sequence[PlanItem], lines: Sequence[VerdictLine]) -> list[tuple[str, bool]]:
    """How far the plan is, each item as "3 of 5 good right steps", and whether it is done.

    Args:
        plan: of the subject.
        lines: the present one of each trial.
    """
    good = [line for line in lines if line.is_last and line.good]
    right, left = sum(one.right_steps for one in good), sum(one.left_steps for one in good)
    counts = {
        "trials": len(good),
        "walks": sum(line.activity == "walk" for line in good),
        "runs": sum(line.activity == "run" for line in good),
        "steps": right + left,
        "right_steps": right,
        "left_steps": left,
    }
    have = [(counts[item.wanted], item) for item in plan]
    return [
        (f"{n} of {item.count} good {item.wanted.replace('_', ' ')}", n >= item.count) for n, item in have
    ]
