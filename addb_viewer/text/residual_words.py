"""What is wrong in plain words: how far motion and forces are apart, where, when and in which direction."""

from collections.abc import Sequence

from addb_viewer.text.diagnosis_vocabulary import (
    about,
    capital,
    listed,
    newtons,
    part_in_words,
    seconds_of,
    upward,
)
from addb_viewer.text.sections import Section
from solver.common.notes import Kind
from solver.diagnosis.causes.about import CorrectedBy
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.diagnosis.residual_description import (
    AxisResidual,
    PhaseResidual,
    Residual,
    ResidualSize,
    TrialResidual,
)

WITHIN = 1.5  # times the noise floor: what is still ordinary
WORST_WITHIN = 2.0  # likewise of the worst half second, which is the worst of many
AHEAD = 1.3  # times the whole: what a single component must exceed to be told before all others
STANDS_OUT = 1.3  # times the trial's own root mean square: half seconds differ by less
LEAST_S = 0.1  # shorter phases say nothing
MOST_TRIALS = 5  # that are told one by one
PHASES = {
    "double_support": "both feet on plates",
    "load_on_no_foot": "a plate loaded, but by no foot",
    "no_load": "no plate loaded",
}
TAKEN_OFF = "taken off as its zero level"  # says the cause that reading the files puts right
TIMES = "×: times what is ordinary there."


def what_is_wrong(figures: DiagnosisReport) -> Section:
    """How far motion and forces are apart, against what is ordinary; and where to look."""
    clean, residual = figures.verdict == "clean", figures.residual
    lines, rows = [], []
    if residual is not None:
        lines = _overall(figures, residual)
        rows = [] if clean else _parts(figures, residual)
    if clean:
        lines.append(f"Looked for, and not found, or too small to act on: {looked_for()}.")
    if any("×" in text for _, text in rows):
        lines.append(TIMES)
    return Section("How that was found" if clean else "What is wrong", tuple(lines), tuple(rows))


def looked_for() -> str:
    """All kinds of causes that are tried, in words."""
    titles = (one.title.split(":")[0] for one in ABOUT.values())
    return ", ".join(title.replace("{target}", "a plate") for title in titles)


def _overall(figures: DiagnosisReport, residual: Residual) -> list[str]:
    lines = [
        f"The motion of the body requires forces that differ from the measured ones by "
        f"{newtons(residual.force_N)}, and moments about the centre of mass that differ by "
        f"{moment_Nm(residual.moment_Nm)} (root mean square).",
        f"A recording of this movement without faults shows about {newtons(residual.force_floor_N)} and "
        f"{moment_Nm(residual.moment_floor_Nm)}, called ordinary here: markers on skin, segment masses "
        f"from tables and filters are not perfect. {_against(figures, residual)}",
    ]
    if in_markers(figures):
        lines.append(_of_the_markers(figures))
    if corrected_causes(figures):
        lines.append("That is with the fault left in, as in the files: the unloaded plate itself shows it.")
    if figures.verdict == "explained":
        before = "; that is before any cause is corrected."
        weighed = [note for note in figures.notes if note.kind is Kind.ENTERED_MASS]
        lines += [f"{capital(note.without_advice)}{before}" for note in weighed]
    return lines


def is_whole(figures: DiagnosisReport) -> bool:
    """Whether causes leave no more than is ordinary."""
    remaining = figures.remaining
    return bool(remaining.linear_residual_N <= WITHIN * remaining.noise_floor_N)


def in_markers(figures: DiagnosisReport) -> bool:
    """Whether every cause that is not corrected on reading lies in the markers."""
    left = [effect for effect in figures.effects if not corrected_on_reading(effect)]
    return bool(left) and all(about(effect).in_markers for effect in left)


def nothing_corrects(effect: Cause) -> bool:
    """Whether a cause stays in the recording whatever is done afterwards."""
    return about(effect).corrected_by is CorrectedBy.NOTHING


def _of_the_markers(figures: DiagnosisReport) -> str:
    """With or without the markers' faults, of which only some can be corrected."""
    corrected = any(about(e).in_markers and not nothing_corrects(e) for e in figures.effects)
    return (
        "Forces are compared with slipped or swapped markers corrected; these show in the markers alone."
        if corrected
        else "Forces are compared with these markers as recorded; their motion shows the fault."
    )


def corrected_on_reading(effect: Cause) -> bool:
    """Whether every fit is without a cause already."""
    return TAKEN_OFF in effect.sentence


def corrected_causes(figures: DiagnosisReport) -> bool:
    """Whether every cause is one that reading the files puts right."""
    effects = figures.effects
    return bool(effects) and all(map(corrected_on_reading, effects))


def _against(figures: DiagnosisReport, residual: Residual) -> str:
    force, moment = ratios(residual)
    more = [
        f"{times(ratio)} times as much {what}"
        for ratio, what in ((force, "force"), (moment, "moment"))
        if ratio > WITHIN
    ]
    if more:
        return f"That is {listed(more)}.{_most_of_all(residual, max(force, moment))}"
    if figures.verdict == "clean" or in_markers(figures) or corrected_causes(figures):
        return f"Here it is {times(force)} times that force and {times(moment)} times that moment: ordinary."
    return (
        "The size alone is ordinary. What shows the fault is its pattern: it varies with the motion, in all "
        "directions and at all times, as errors of markers, plates and masses do not."
    )


def _most_of_all(residual: Residual, overall: float) -> str:
    """A sentence on the component of force or moment that is further beyond the ordinary than the whole."""
    components = [
        (ratio, what, axis)
        for axis in residual.axes
        for ratio, what in zip(ratios(axis), ("force along", "moment about"), strict=True)
    ]
    ratio, what, axis = max(components, key=lambda c: c[0])
    if ratio <= AHEAD * overall:
        return ""
    direction = f" ({axis.direction})" if axis.direction else ""
    return f" The largest excess is in the {what} {axis.axis}{direction}: {times(ratio)} times."


def _parts(figures: DiagnosisReport, residual: Residual) -> list[tuple[str, str]]:
    rows = [
        _over_time(figures, residual.trials),
        ("in which phase", _phases(residual.phases)),
        ("in which direction", _directions(residual.axes)),
    ]
    turning = [a for a in residual.axes if ratios(a)[1] > WITHIN]
    if turning:
        ordered = sorted(turning, key=lambda a: -ratios(a)[1])
        rows.append(("turning", ", ".join(f"about {a.axis} {_moment(a, WITHIN)}" for a in ordered)))
    return [row for row in rows if row[1]]


def _over_time(figures: DiagnosisReport, trials: Sequence[TrialResidual]) -> tuple[str, str]:
    """The worst half second of each trial, the worst trial first; or that there is none."""
    ordered = sorted(trials, key=lambda t: -max(ratios(t.worst)))
    said = []
    for trial in ordered[:MOST_TRIALS]:
        worst = trial.worst
        if max(ratios(worst)) <= WORST_WITHIN:
            said.append(f"{trial.trial}: no half second beyond twice the ordinary")
            continue
        if not _stands_out(trial):
            said.append(f"{trial.trial}: much the same all the time")
            continue
        start, end = worst.frames
        seconds = seconds_of(figures, trial.trial, start, end)
        said.append(f"{trial.trial}, {seconds}: {_both(worst, WORST_WITHIN)}")
    if len(ordered) > MOST_TRIALS:
        said.append(f"less in {len(ordered) - MOST_TRIALS} more")
    label = "worst half second" if any(map(_stands_out, trials)) else "over time"
    return label, "; ".join(said)


def _stands_out(trial: TrialResidual) -> bool:
    """Whether its worst half second is beyond the ordinary, and beyond the rest of the trial."""
    worst = trial.worst
    return max(ratios(worst)) > WORST_WITHIN and (
        worst.force_N > STANDS_OUT * trial.force_N or worst.moment_Nm > STANDS_OUT * trial.moment_Nm
    )


def _phases(phases: Sequence[PhaseResidual]) -> str:
    long = [p for p in phases if p.seconds >= LEAST_S]
    ordered = sorted(long, key=lambda p: -max(ratios(p)))
    return "; ".join(f"{_phase(p)}: {_both(p, WITHIN)}" for p in ordered)


def _phase(phase: PhaseResidual) -> str:
    if phase.foot is not None:
        return f"only the {part_in_words(phase.foot)} on a plate"
    return PHASES[phase.phase]


def _directions(axes: Sequence[AxisResidual]) -> str:
    ordered = sorted(axes, key=lambda a: -a.force_N)
    text = ", ".join(f"{_axis(a)} {_force(a, WITHIN)}" for a in ordered)
    mean = [a.mean_force_N for a in axes]
    size = sum(f * f for f in mean) ** 0.5
    if size <= sum(a.force_floor_N**2 for a in axes) ** 0.5:
        return text
    return f"{text}; on average {_mean_in_words(mean, size)}"


def _mean_in_words(required_N: Sequence[float], size: float) -> str:
    """What the plates measured beyond what the body demands, or short of it."""
    way = upward(required_N)
    if way in ("up", "down"):
        more = "more" if way == "down" else "less"
        asked = "the weight and motion of the modelled body require"
        return f"the plates measured {newtons(size)} {more} upward than {asked}"
    measured = upward([-f for f in required_N])
    return f"the plates measured {newtons(size)} more {measured} than the modelled body's motion requires"


def _axis(axis: AxisResidual) -> str:
    return f"{axis.direction} ({axis.axis})" if axis.direction else str(axis.axis)


def _both(size: ResidualSize, within: float) -> str:
    return f"{_force(size, within)}, {_moment(size, within)}"


def _force(size: ResidualSize, within: float) -> str:
    return newtons(size.force_N) + _marked(ratios(size)[0], within)


def _moment(size: ResidualSize, within: float) -> str:
    return moment_Nm(size.moment_Nm) + _marked(ratios(size)[1], within)


def _marked(ratio: float, within: float) -> str:
    return f" ({times(ratio)} ×)" if ratio > within else ""


def ratios(size: ResidualSize) -> tuple[float, float]:
    """Force and moment over their noise floors."""
    return size.force_N / size.force_floor_N, size.moment_Nm / size.moment_floor_Nm


def times(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{round(ratio, 1):g}"


def moment_Nm(moment: float) -> str:
    return f"{moment:.0f} N·m" if moment >= 10 else f"{moment:.1f} N·m"
