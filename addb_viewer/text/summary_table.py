"""The summary of a fit in the terminal: units in the heads, ✓ and ✗ where Hicks et al. 2015 set a bound."""

import sys
from collections.abc import Iterator, Sequence
from io import StringIO

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from addb_viewer.text.amounts import kilograms
from addb_viewer.text.change_words import change_sentence
from addb_viewer.text.held_out_words import cutoff_words, held_out_words, worse_words
from addb_viewer.text.note_words import by_kind
from addb_viewer.text.stored_words import stored_words
from solver.dynamics.thresholds import Thresholds
from solver.fitting.fit_summary import FitSummary, HeldOutFigures, TrialFigures

WIDTH_OF_A_PIPE = 120  # [characters] where no terminal says how wide it is
_MOST_DECISIONS = 5  # lines: with what is held out, noted, written and not used ten, before the verdicts
_MASKS = {
    "review": "the review",
    "review.json": "the imported review.json",
    "proposals": "detection, not reviewed",
}
_COLUMNS = ("used of\nframes", "marker\nRMS cm", "\nmax cm", "force\nN", "\nBW", "moment\nN·m", "\nBW·h")


def print_summary(figures: FitSummary, *, notes: bool = False, closing: Sequence[str] = ()) -> None:
    """Print the figures of a fit: the table, and what needs a decision.

    Args:
        figures: of a subject.
        notes: all that was noted, by kind, and all figures of each trial, in place of what needs a decision.
        closing: lines to end with.
    """
    _print(console(), figures, notes, closing)


def console(width_of_a_pipe: int = WIDTH_OF_A_PIPE) -> Console:
    """What tables are printed on."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else width_of_a_pipe)


def summary_text(figures: FitSummary) -> str:
    """The same as a text: the table, and what needs a decision."""
    file = StringIO()
    written = Console(highlight=False, width=WIDTH_OF_A_PIPE, file=file, force_jupyter=False)
    _print(written, figures, notes=False, closing=())
    return "\n".join(line.rstrip() for line in file.getvalue().splitlines())


def _print(console: Console, figures: FitSummary, notes: bool, closing: Sequence[str]) -> None:
    console.print(_subject_line(figures))
    console.print(_table(figures.trials))
    console.print(_legend(), style="dim")
    if notes:
        _print_all(console, figures)
    else:
        for line in after_table(figures):
            console.print(Text(line), soft_wrap=True)
    if figures.files:
        console.print(Text(f"written: {figures.files[0]}"), soft_wrap=True)
    for line in closing:
        console.print(Text(line), soft_wrap=True)


def _print_all(console: Console, figures: FitSummary) -> None:
    for line in _honesty(figures.trials):
        console.print(line, soft_wrap=True)
    for trial in figures.trials:
        if changed := change_sentence(trial.change):
            console.print(Text(f"{trial.name}: {changed[0].lower()}{changed[1:]}"), soft_wrap=True)
    for found in by_kind(figures.notes):
        console.print(Text(f"{found.heading}:"), style="bold" if found.needs_decision else "")
        for note in found.notes:
            console.print(Text(f"  note: {note}"), soft_wrap=True)


def after_table(figures: FitSummary) -> list[str]:
    """How well held-out forces are predicted, what needs a decision, what is noted: at most seven lines."""
    kinds = by_kind(figures.notes)
    decisions = [
        *_about_trials(figures.trials),
        *(found.key_findings for found in kinds if found.needs_decision),
    ]
    shown, left = decisions[:_MOST_DECISIONS], len(decisions) - _MOST_DECISIONS
    rest = [f"{left} more to decide"] if left > 0 else []
    rest += _chosen_by_people(figures.trials)
    if any(trial.stored for trial in figures.trials):
        rest.append("figures stored in the file")
    rest += [found.heading for found in kinds if not found.needs_decision]
    return [
        *_held_out_at_worst(figures.trials),
        *(f"! {line}" for line in shown),
        *([f"also noted (--notes): {'; '.join(rest)}"] if rest else []),
    ]


def _about_trials(trials: Sequence[TrialFigures]) -> Iterator[str]:
    """What the figures themselves ask somebody to decide, for all trials at once."""
    worse = [f"{trial.name}: {said}" for trial in trials for said in worse_words(trial)]
    if worse:
        yield worse[0] + (f" (and {len(worse) - 1} more)" if len(worse) > 1 else "")
    proposed = [trial.name for trial in trials if "proposals" in trial.masks]
    if proposed:
        yield f"frames left out by detection that nobody has reviewed: {', '.join(proposed)}"


def _chosen_by_people(trials: Sequence[TrialFigures]) -> list[str]:
    """Whose review says which frames count, once for all trials."""
    sources = dict.fromkeys(source for trial in trials for source in trial.masks)
    chose = [_MASKS[source] for source in sources if source not in ("none", "proposals")]
    return [f"frames chosen by {' and '.join(chose)}"] if chose else []


def _held_out_at_worst(trials: Sequence[TrialFigures]) -> list[str]:
    """The trial whose force is missed by most on held-out blocks, against the markers alone."""
    blocks = {t.name: own.blocks for t in trials if (own := t.held_out_layouts) and own.blocks}
    if not blocks:
        return []
    name = max(blocks, key=lambda each: blocks[each].force.rms)
    where = f"{name}, worst of {len(blocks)}" if len(blocks) > 1 else name
    force, moment = blocks[name].force, blocks[name].moment
    return [
        f"held-out forces ({where}): predicted to {force.rms:.1f} N and {moment.rms:.1f} N·m, "
        f"by the markers alone to {force.markers_rms:.1f} N and {moment.markers_rms:.1f} N·m"
    ]


def _subject_line(figures: FitSummary) -> Text:
    subject, model = figures.subject, figures.model
    entered = subject.mass_entered_kg
    of_scale = f" ({entered:.1f} kg entered)" if entered is not None else ""
    mass = "mass unknown"
    if subject.mass_kg is not None:
        mass = kilograms(subject.mass_kg, subject.mass_std_kg)
    height = f"{subject.height_m:.2f} m" if subject.height_m is not None else "height unknown"
    return Text(f"{mass}{of_scale}, {height}; {model.bodies} bodies, {model.dofs} degrees of freedom")


def _table(trials: Sequence[TrialFigures]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("trial", overflow="fold", min_width=8)
    for head in _COLUMNS:
        table.add_column(Text(head), justify="right", no_wrap=True)
    for trial in trials:
        table.add_row(*_row(trial))
    return table


def _row(trial: TrialFigures) -> list[Text]:
    linear, angular, hicks = trial.linear_residual, trial.angular_residual, trial.hicks
    moment = _judged(trial.moment_BWh, ".4f", hicks.angular)
    if hicks.angular_paper is not None:
        moment.append(f" ({_mark(hicks.angular_paper)})")
    return [
        Text(trial.name),
        Text(f"{trial.frames_with_force_used} of {trial.frames}"),
        _judged(_in_cm(trial.marker_rms_m), ".2f", hicks.marker_rms),
        _judged(_in_cm(trial.marker_max_m), ".1f", hicks.marker_max),
        _judged(linear and linear.rms_N, ".1f", None),
        _judged(trial.force_BW, ".4f", hicks.linear),
        _judged(angular and angular.rms_Nm, ".1f", None),
        moment,
    ]


def _honesty(trials: Sequence[TrialFigures]) -> Iterator[Text]:
    """What a low residual does not say: whose mask it is, and how well held-out forces are predicted."""
    for trial in trials:
        parts = []
        if trial.mask_source != "none":
            chose = [_MASKS[source] for source in trial.masks]
            parts.append(f"frames chosen by {' and '.join(chose)}")
        if trial.forces_predicted:
            parts.append("no measured force: forces and torques are predicted from the motion, no residual")
        held_out = trial.held_out
        if held_out is not None:
            linear, angular = held_out.linear_residual, held_out.angular_residual
            parts.append(
                f"error on {held_out.frames} frames of the first layout held out {linear.rms_N:.1f} N, "
                f"{angular.rms_Nm:.1f} N·m{_markers_alone(held_out)}"
            )
            if held_out.learnt:
                own = held_out.motion_only_linear_residual, held_out.motion_only_angular_residual
                parts.append(
                    f"predicted with learnt {', '.join(held_out.learnt)}; from the fit's own motion alone "
                    f"{own[0].rms_N:.1f} N, {own[1].rms_Nm:.1f} N·m"
                )
        if parts:
            yield Text(f"{trial.name}: {'; '.join(parts)}")
        yield from (Text(f"{trial.name}: {words}") for words in stored_words(trial.stored))
        yield from _held_out(trial)


def _held_out(trial: TrialFigures) -> Iterator[Text]:
    """A trial's layouts of held-out forces, and where the fit is worse than the markers alone."""
    for said in held_out_words(trial):
        yield Text(f"{trial.name}: held out: {said}")
    for said in worse_words(trial):
        yield Text(f"{trial.name}: {said}", style="red")


def _markers_alone(held_out: HeldOutFigures) -> str:
    force = held_out.kinematics_only_linear_residual.rms_N
    moment = held_out.kinematics_only_angular_residual.rms_Nm
    at = cutoff_words(held_out.markers_cutoff_hz)
    return f" (markers alone at {at} {force:.1f} N, {moment:.1f} N·m)"


def _in_cm(metres: float | None) -> float | None:
    return None if metres is None else 100 * metres


def _judged(value: float | None, form: str, passed: bool | None) -> Text:
    if value is None:
        return Text("–")
    number = format(value, form)
    if passed is None:
        return Text(number)
    return Text(f"{number} {_mark(passed)}", style="green" if passed else "red")


def _mark(passed: bool) -> str:
    return "✓" if passed else "✗"


def _legend() -> Text:
    limits = Thresholds()
    return Text(
        "used: frames whose forces count. force, moment: RMS residual over them, the moment about the root "
        f"joint's centre. ✓ within, ✗ beyond Hicks et al. 2015: marker RMS {100 * limits.marker_rms_m:g} cm, "
        f"max {100 * limits.marker_max_m:g} cm, force {limits.linear_BW} BW, moment {limits.angular_BWh} "
        f"BW·h (in brackets: {limits.angular_paper_BWh} BW·h, the dataset paper's bound)."
    )
