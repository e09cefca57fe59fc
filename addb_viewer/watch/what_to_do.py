"""What to do now in the laboratory, in one sentence, and the words of a verdict; from typed results alone.

Both follow from one list of findings: what the recording shows by itself, then the causes in the verdict's
order, then direct checks. The sentence tells the first of them, and a second one that it may be instead or
as well; what the verdict names is among the two.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from addb_viewer.text.amounts import counted
from addb_viewer.text.cause_words import trial_in_words
from addb_viewer.text.diagnosis_vocabulary import (
    CONFIDENT,
    about,
    capital,
    listed,
    names_of,
    rivals_of,
    short_title,
    target_in_words,
    tentative_of,
)
from addb_viewer.text.direct_check_words import ABOUT
from addb_viewer.text.residual_words import corrected_on_reading
from addb_viewer.trial_view.trial_verdict import LEAST_SURE, TrialVerdict, reason_words, trial_verdict
from addb_viewer.watch.judging import FirstLook, FitLook, Look, Step
from addb_viewer.watch.verdict_log import Colour, Stage, VerdictLine
from solver.capture.capture import PlanItem, Wanted
from solver.diagnosis.diagnosis import ToBeSure
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Rival
from solver.diagnosis.direct_checks.statement import STATED_NATS
from solver.diagnosis.direct_checks.statement import About as Class
from solver.fitting.verdict import Reason, Use, Why

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
BY_CHECK = {  # the branch of the catalogue that a direct check speaks for
    Class.ENTERED_MASS: "body/whole mass",
    Class.LOAD: "on the person/load",
    Class.OFF_PLATE: "ground/missed step",
    Class.CLOCK: "time/clock",
    Class.FILTER: "time/filter",
    Class.PLATE_SIGN: "plate/channels",
    Class.PLATE_ZERO: "plate/zero",
    Class.PLATE_SCALE: "plate/scale",
    Class.PLATE_PLACE: "plate/geometry",
    Class.PLATE_TURN: "plate/geometry",
    Class.SLIP: "markers/one",
    Class.SEGMENT: "markers/several at once",
}
BY_REASON = {
    Why.NO_POSE: "Repeat: too few markers were seen",
    Why.NO_FRAMES: "Repeat: on no frame every foot was on a plate",
    Why.MARKERS: "Look at the labels and the static trial, then repeat",
    Why.MOMENT: "Keep it and record one more: forces and motion disagree",
    Why.FORCE: "Keep it and record one more: forces and motion disagree",
    Why.UNEXPLAINED: "Keep it and record one more: something is wrong that has no name",
    Why.MARKER: f"{NOTHING}; look at one marker",
    Why.NO_FORCES: f"{NOTHING}, if no plates were to be recorded",
}
HARMLESS = "; nothing to repeat"  # an act that can wait
OFF_PLATE = "ground/missed step"  # the branch
ZERO = "plate/zero"
OF_LABORATORY = ("time/", "plate/")  # branches of what stays from trial to trial
APART_S = 0.1  # of beginnings or ends: programs write markers and forces of one trial equally long
MOST_NAMED = 3  # markers, or steps, in a sentence


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a trial, or may be, and what to do about it."""

    branch: str  # of the catalogue of causes; a word of its own where that has none
    target: str  # plate_1, a body, markers; frames of a step, as 20:50; empty: no one place
    words: str  # what it is, within a sentence
    act: str = ""
    sure: bool = True
    alone: str = ""  # how it is said at the beginning, where that is not "Words: act"

    @property
    def key(self) -> str:
        """Branch and target, as the log has them."""
        return f"{self.branch} {self.target}".strip()

    @property
    def beside(self) -> str:
        """How it is said behind another one, of which it may take the place."""
        return ": ".join(filter(None, (self.words, self.act)))

    @property
    def text(self) -> str:
        """How it is said at the beginning."""
        return self.alone or capital(self.beside if self.sure else f"may be {self.beside}")


class Told(NamedTuple):
    """A verdict in words."""

    colour: Colour
    words: str
    to_do: str
    about: tuple[str, ...] = ()  # keys of the findings that `to_do` tells
    against: str = ""  # why the plan does not count the trial


def first_told(found: FirstLook, former: Sequence[Sequence[str]], kept: Sequence[str] = ()) -> Told:
    """Of the first look.

    Args:
        found: by it.
        former: of the trials before, the last ones last, plates whose zero level was off, and `Told.about`.
        kept: files that were not replaced when others of the trial were.
    """
    findings = [*_mixed(found.look, kept), *_zero(found.look, former), *_no_load(found.look)]
    if found.unborne_s and not findings:
        at = listed([f"{time:.1f} s" for time in found.unborne_s[:MOST_NAMED]])
        begin = "May have to be repeated: a step may have missed the plates"
        beside = f"a step beside the plates at {at}"
        findings.append(Finding(OFF_PLATE, "", beside, "repeat", sure=False, alone=f"{begin} at {at}"))
    for one in sorted(found.statements, key=lambda one: -one.loudest):
        said = [_of_check(kind, one.target) for kind in one.spoken_for(STATED_NATS)[:1]]
        findings += _others(said, findings)
    if found.look.lost:
        findings.append(Finding("markers/lost", found.look.lost[0][0], _lost(found.look)))
    words = "First look: something to look at" if findings else "First look: nothing found"
    told = _shown(findings, "")
    colour = Colour.YELLOW if told else Colour.NONE
    return Told(colour, words, _sentence(told) or "Wait for the verdict", _keys(told))


def told(
    fit: FitLook,
    report: DiagnosisReport | None,
    former: Sequence[Sequence[str]],
    kept: Sequence[str] = (),
    *,
    is_last: bool = True,
) -> Told:
    """Of the fit, and of the diagnosis where there is one.

    Args:
        fit: of the trial.
        report: of its diagnosis; None: there is none, or not yet.
        former: as in `first_told`.
        kept: as there.
        is_last: the diagnosis is not to come any more, and may take back what the fit alone would ask for.
    """
    mixed = list(_mixed(fit.look, kept))
    if mixed and mixed[0].sure:
        words = "Not usable · markers and forces are of two recordings"
        return Told(Colour.RED, words, mixed[0].text, _keys(mixed), mixed[0].words)
    found = trial_verdict(fit.figures, None, report)
    named = [] if report is None else [c for c in names_of(report) if not corrected_on_reading(c)]
    tentative = [] if report is None else tentative_of(report)
    line, decides = found.line, found.verdict.decides
    sound = found.verdict.use is Use.TORQUES  # then motion and forces are of one recording
    facts = [*(() if sound else mixed), *_zero(fit.look, former), *_no_load(fit.look), *_missed(fit, named)]
    causes = [*_spoilt(found, named), *_causes(found, report, fit, named)] if report else []
    once: dict[str, Finding] = {}
    for one in (*facts, *causes):
        once.setdefault(one.key, one)
    findings = list(once.values())
    colour = COLOURS[line.sign]
    if (findings or mixed) and colour is Colour.GREEN:
        colour = Colour.YELLOW
    findings += _beyond_plates(fit, named)
    if report is not None and found.verdict.reasons:
        loud = sorted((c for c in report.direct_checks if c.speaks_for), key=lambda c: -max(c.nats.values()))
        findings += _others([_of_check(Class(one.speaks_for[0]), one.target) for one in loud], findings)
    deciding = next((c for c in (*named, *tentative) if decides and decides.of == f"{c.id} {c.target}"), None)
    branch = about(deciding).branch if deciding else ""
    if deciding and findings and branch not in {one.branch for one in findings}:
        findings.append(_of_cause(deciding))
    shown = _shown(findings, branch)
    if sound and shown:  # never in silence
        shown = (shown[0], *(mixed or shown[1:]))
    shown = [_as_before(one, former) for one in shown]
    rest = [f"{NOTHING}, if {listed(kept)} is right: it was not replaced"] if mixed else []
    rest += _of_figures(found.verdict.reasons, tentative) if is_last else []
    rest += [f"{NOTHING}; a weak sign of {short_title(cause)}" for cause in tentative]
    rest += [f"{NOTHING}; {_lost(fit.look)}"] if fit.look.lost else []
    to_do = _sentence(shown) or [*rest, NOTHING if is_last else "Wait for the diagnosis"][0]
    words = " · ".join(filter(None, (", ".join(filter(None, (line.use, line.band))), line.frames, line.why)))
    against = ""
    if found.verdict.use is not Use.TORQUES or fit.look.off_zero:
        against = findings[0].words if findings else reason_words(decides) if decides else line.use.lower()
    return Told(colour, words, to_do, _keys(shown), against)


def broken_told(reason: str) -> Told:
    """Of a trial that cannot be read or fitted."""
    words, to_do = "Not usable · cannot be judged", f"Export it again, or repeat: {reason}"
    return Told(Colour.RED, words, to_do, against="it cannot be judged")


def missed_words(fit: FitLook) -> tuple[str, ...]:
    """Of each step that missed the plates, which foot it was."""
    return tuple(_missed_by(step) for step in fit.steps if step.missed)


def _shown(findings: Sequence[Finding], decides: str) -> Sequence[Finding]:
    """The first, and one beside it: what the verdict names, by its branch, else the next."""
    if not findings:
        return ()
    first, *rest = findings
    named = [one for one in rest if one.branch == decides != first.branch]
    return (first, *(named or rest)[:1])


def _sentence(shown: Sequence[Finding]) -> str:
    """What is sure stands beside the other; of two that are not, it may be either."""
    if len(shown) < 2:
        return "".join(one.text for one in shown)
    first, second = shown[0].text, shown[1].words if shown[1].act == shown[0].act else shown[1].beside
    if not first.endswith(HARMLESS) or not second.endswith(HARMLESS):
        second = second.removesuffix(HARMLESS)  # there is something to repeat
    if not any(one.sure for one in shown):
        return f"{first.removesuffix(HARMLESS)}; or {second}"
    return f"{first.removesuffix(HARMLESS)}; also {second if shown[1].sure else f'may be {second}'}"


def _keys(shown: Sequence[Finding]) -> tuple[str, ...]:
    return tuple(one.key for one in shown)


def _others(said: Sequence[Finding], findings: Sequence[Finding]) -> Iterator[Finding]:
    """What direct checks say of other causes at other places than what is found already."""
    branches = {one.branch for one in findings}
    places = {part for one in findings for part in one.target.split("+") if part}
    for one in said:
        if one.branch not in branches and places.isdisjoint(one.target.split("+")):
            branches.add(one.branch)
            yield one


def _spoilt(found: TrialVerdict, named: Sequence[Cause]) -> Iterator[Finding]:
    """What leaves nothing of the trial, unless a fault of the markers is named that may be its cause."""
    worst = next(iter(found.verdict.reasons), None)
    if worst is None or worst.leaves is not Use.NOTHING or worst.why not in BY_REASON:
        return
    if not any(about(cause).in_markers for cause in named):
        yield Finding(f"figures/{worst.why}", "", reason_words(worst), "repeat", alone=BY_REASON[worst.why])


def _causes(
    found: TrialVerdict, report: DiagnosisReport, fit: FitLook, named: Sequence[Cause]
) -> Iterator[Finding]:
    """Named causes, those that limit the trial's use first, each with what it may be instead if unsure."""
    order = [reason.of for reason in found.verdict.reasons if reason.why is Why.CAUSE]
    off_plate = _off_plate(fit, named)
    for cause in sorted(named, key=lambda c: [*order, key := f"{c.id} {c.target}"].index(key)):
        if off_plate and _is_off_plate(cause):
            continue
        yield _of_cause(cause, report.to_be_sure)
        if cause.confidence < LEAST_SURE:
            others = [r for r in rivals_of(report, cause) if about(r).branch != about(cause).branch]
            likeliest = sorted(others, key=lambda rival: -(rival.confidence or 0.0))
            yield from map(_of_cause, likeliest[:1])


def _of_figures(reasons: Sequence[Reason], tentative: Sequence[Cause]) -> list[str]:
    """What the figures alone ask for; where no cause is sure of those that may be behind them."""
    weak = f"; a weak sign of {short_title(tentative[0])}" if tentative else ", and no cause is named"
    unnamed = (Why.MOMENT, Why.FORCE)
    return [BY_REASON[r.why] + (weak if r.why in unnamed else "") for r in reasons if r.why in BY_REASON]


def _missed(fit: FitLook, named: Sequence[Cause]) -> Iterator[Finding]:
    """Steps between others that no plate measured."""
    missed = [step for step in fit.steps if step.missed]
    missed += [s for s in _off_plate(fit, named) if s not in missed and _is_amid(s, fit.steps)]
    if not missed:
        return
    sure = missed[0].missed or any(c.confidence >= CONFIDENT for c in named if _is_off_plate(c))
    begin, has = ("Repeat", "missed") if sure else ("May have to be repeated", "may have missed")
    steps = listed([f"step {s.number} {has} {_plate_of(s)}" for s in missed[:MOST_NAMED]])
    words = (
        _missed_by(missed[0]) if sure else f"a {missed[0].side.lower()} step beside {_plate_of(missed[0])}"
    )
    yield Finding(OFF_PLATE, _frames_of(missed), words, "repeat", sure, f"{begin}: {steps}")


def _off_plate(fit: FitLook, named: Sequence[Cause]) -> list[Step]:
    """Steps of which the diagnosis says that no plate measured them."""
    causes = [cause for cause in named if _is_off_plate(cause)]
    return [step for step in fit.steps if any(_is_of(cause, step) for cause in causes)]


def _is_off_plate(cause: Cause) -> bool:
    return about(cause).branch == OFF_PLATE


def _beyond_plates(fit: FitLook, named: Sequence[Cause]) -> Iterator[Finding]:
    """Steps on the way to the plates, or from them: whether they should be on one nobody has said."""
    steps = [step for step in _off_plate(fit, named) if not _is_amid(step, fit.steps)]
    if steps:
        told = listed([f"step {step.number}" for step in steps[:MOST_NAMED]])
        unless = f"{NOTHING}, unless {told} {'was' if len(steps) == 1 else 'were'} to be on a plate"
        frames = _frames_of(steps)
        yield Finding(OFF_PLATE, frames, f"{told} on no plate", "repeat if that was wanted", alone=unless)


def _frames_of(steps: Sequence[Step]) -> str:
    """A finding's target."""
    return "+".join(f"{first}:{end}" for first, end in (step.frames for step in steps))


def _of_check(kind: Class, target: str | None) -> Finding:
    what, branch = f" ({target_in_words(target)})" if target else "", BY_CHECK[kind]
    act = BY_BRANCH[branch].removesuffix(HARMLESS)  # it alone cannot tell
    return Finding(branch, target or "", f"{ABOUT[kind]}{what}", act, sure=False)


def _of_cause(cause: Cause | Rival, asked: ToBeSure | None = None) -> Finding:
    """A cause, and what to do about it; where a short trial would decide it, that trial."""
    branch, sure = about(cause).branch, (cause.confidence or 0.0) >= CONFIDENT
    act = BY_BRANCH.get(branch, "look at the diagnosis")
    if asked is not None and asked.trial is not None and (asked.id, asked.target) == (cause.id, cause.target):
        act = f"to be sure, {trial_in_words(asked)}"
    return Finding(branch, cause.target, short_title(cause), act, sure)


def _is_of(cause: Cause, step: Step) -> bool:
    """Whether most of a stretch of a cause's frames is a step's, of the same foot."""
    first, end = step.frames
    shared = [(min(b, end) - max(a, first), b - a) for _, a, b in cause.frames]
    return cause.target.endswith("_r") == (step.side == "Right") and any(2 * own > all for own, all in shared)


def _is_amid(step: Step, steps: Sequence[Step]) -> bool:
    whole = [one.number for one in steps if one.whole]
    return bool(whole) and whole[0] < step.number < whole[-1]


def _missed_by(step: Step) -> str:
    return f"{step.side.lower()} foot missed {_plate_of(step)}"


def _plate_of(step: Step) -> str:
    return f"plate {step.plate}" if step.plate else "the plates"


def _mixed(look: Look, kept: Sequence[str]) -> Iterator[Finding]:
    """Files of a former recording beside those of a new one."""
    if not kept:
        return
    files = listed(kept)
    if look.apart_s >= APART_S:
        words = f"{files} is of the former recording"
        alone = f"Export {files} again: it is of the former recording, {look.apart_s:.1f} s longer or shorter"
        yield Finding("files/former", "", words, "export it again", alone=alone)
    else:
        yield Finding("files/former", "", f"{files} of the former recording", "export it again", sure=False)


def _zero(look: Look, former: Sequence[Sequence[str]]) -> Iterator[Finding]:
    """Plates that do not read zero while empty: less than nothing where a load was on them at taring."""
    for plate, level_N in look.off_zero:
        since = 1 + _times_before(f"plate_{plate}", former)
        trials = "this trial" if since == 1 else f"the last {counted(since, 'trial')}"
        act = f"tare and repeat {trials}"
        why = "a load at taring" if level_N < 0 else "an object or no taring"
        level = f"{'+' if level_N > 0 else '−'}{abs(level_N):.0f}\u00a0N"
        reads = f"Plate {plate} reads {level} while empty, may be {why}: {act}"
        yield Finding(ZERO, f"plate_{plate}", f"plate {plate} is off its zero", act, alone=reads)


def _times_before(key: str, former: Sequence[Sequence[str]]) -> int:
    return next((n for n, found in enumerate(reversed(former)) if key not in found), len(former))


def _as_before(finding: Finding, former: Sequence[Sequence[str]]) -> Finding:
    """The same, with how many trials before had it: then it is the laboratory's, not this trial's."""
    times = _times_before(finding.key, former) if finding.branch.startswith(OF_LABORATORY) else 0
    trials = "trial" if times == 1 else counted(times, "trial")
    return replace(finding, words=f"{finding.words}, as in the {trials} before") if times else finding


def _no_load(look: Look) -> Iterator[Finding]:
    if look.has_plates and not look.is_loaded:
        yield Finding("plate/no load", "", "no plate bore a load", "repeat; were the amplifiers on?")


def _lost(look: Look) -> str:
    (name, seconds), more = look.lost[0], len(look.lost) - 1
    others = f", {counted(more, 'other')} as well" if more else ""
    return f"marker {name} was lost for {seconds:.1f} s{others}"


def plan_words(plan: Sequence[PlanItem], lines: Sequence[VerdictLine]) -> list[tuple[str, bool | None]]:
    """How far the plan is, each item as "3 of 5 good right steps", and whether it is done.

    Behind them stands why the newest trial counts for none of them, if that is so; None beside it.

    Args:
        plan: of the subject.
        lines: the present one of each trial, the newest last.
    """
    judged = [line for line in lines if line.is_last]
    each = [[_counts(line)[item.wanted] for line in judged] for item in plan]
    words: list[tuple[str, bool | None]] = [
        (f"{sum(n)} of {item.count} good {item.wanted.replace('_', ' ')}", sum(n) >= item.count)
        for n, item in zip(each, plan, strict=True)
    ]
    last = judged[-1] if judged else None
    if plan and last is not None and last.stage is not Stage.STATIC and not any(n[-1] for n in each):
        words.append((f"trial {last.trial} does not count: {_why_not(last, plan)}", None))
    return words


def _counts(line: VerdictLine) -> Mapping[Wanted, int]:
    """What one trial counts for."""
    right, left = line.right_steps * line.good, line.left_steps * line.good
    return {
        "trials": int(line.good),
        "walks": int(line.good and line.activity == "walk"),
        "runs": int(line.good and line.activity == "run"),
        "steps": right + left,
        "right_steps": right,
        "left_steps": left,
    }


def _why_not(line: VerdictLine, plan: Sequence[PlanItem]) -> str:
    if line.against or line.missed:
        return line.against or listed(line.missed[:MOST_NAMED])
    wanted = [item.wanted.removesuffix("s").replace("_", " ") for item in plan]
    steps = [one for one in wanted if one.endswith("step")]
    return f"no {steps[0]} lies wholly on a plate" if steps else f"it is no {' and no '.join(wanted)}"
