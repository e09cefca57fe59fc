"""The summary of a fit in the terminal: units in the heads, ✓ and ✗ where Hicks et al. 2015 set a bound."""

import sys
from collections.abc import Iterator
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from addb_viewer.change_words import change_sentence
from addb_viewer.stored_words import stored_words
from addb_viewer.withheld_words import cutoff_words, withheld_words, worse_words
from solver.dynamics.thresholds import Thresholds

_WIDTH_OF_A_PIPE = 120  # [characters] where no terminal says how wide it is
_MASKS = {
    "review": "the review",
    "review.json": "the imported review.json",
    "proposals": "detection, not reviewed",
}
_COLUMNS = ("used of\nframes", "marker\nRMS cm", "\nmax cm", "force\nN", "\nBW", "moment\nN·m", "\nBW·h")


def print_summary(figures: dict[str, Any]) -> None:
    """Print what `solver.summary.summary` found."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH_OF_A_PIPE)
    console.print(_subject_line(figures))
    console.print(_table(figures["trials"]))
    console.print(_legend(), style="dim")
    for line in _honesty(figures["trials"]):
        console.print(line, soft_wrap=True)
    for trial in figures["trials"]:
        if changed := change_sentence(trial.get("change")):
            console.print(Text(f"{trial['name']}: {changed[0].lower()}{changed[1:]}"), soft_wrap=True)
    for note in figures["notes"]:
        console.print(Text(f"note: {note}"), soft_wrap=True)
    if figures["files"]:
        console.print(Text(f"written: {figures['files'][0]}"), soft_wrap=True)


def print_withheld(figures: dict[str, Any]) -> None:
    """Print how well forces were foretold on all layouts that have been judged.

    Args:
        figures: as `solver.summary.summary` found them.
    """
    console = Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH_OF_A_PIPE)
    for trial in figures["trials"]:
        for line in _withheld(trial):
            console.print(line, soft_wrap=True)


def _subject_line(figures: dict[str, Any]) -> Text:
    subject, model = figures["subject"], figures["model"]
    entered = subject["mass_entered_kg"]
    of_scale = f" ({entered:.1f} kg entered)" if entered is not None else ""
    height = f"{subject['height_m']:.2f} m" if subject["height_m"] is not None else "height unknown"
    return Text(
        f"{subject['mass_kg']:.1f} kg{of_scale}, {height}; "
        f"{model['bodies']} bodies, {model['dofs']} degrees of freedom"
    )


def _table(trials: list[dict[str, Any]]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("trial", overflow="fold", min_width=8)
    for head in _COLUMNS:
        table.add_column(Text(head), justify="right", no_wrap=True)
    for trial in trials:
        table.add_row(*_row(trial))
    return table


def _row(trial: dict[str, Any]) -> list[Text]:
    linear, angular, hicks = trial["linear_residual"] or {}, trial["angular_residual"] or {}, trial["hicks"]
    moment = _judged(angular.get("rms_BWh"), ".4f", hicks["angular"])
    if hicks["angular_paper"] is not None:
        moment.append(f" ({_mark(hicks['angular_paper'])})")
    return [
        Text(trial["name"]),
        Text(f"{trial['frames_with_force_used']} of {trial['frames']}"),
        _judged(_in_cm(trial["marker_rms_m"]), ".2f", hicks["marker_rms"]),
        _judged(_in_cm(trial["marker_max_m"]), ".1f", hicks["marker_max"]),
        _judged(linear.get("rms_N"), ".1f", None),
        _judged(linear.get("rms_BW"), ".4f", hicks["linear"]),
        _judged(angular.get("rms_Nm"), ".1f", None),
        moment,
    ]


def _honesty(trials: list[dict[str, Any]]) -> Iterator[Text]:
    """What a low residual does not say: whose mask it is, and how well withheld forces are predicted."""
    for trial in trials:
        parts = []
        if trial["mask_source"] != "none":
            chose = [_MASKS[source] for source in trial["mask_source"].split(" + ")]
            parts.append(f"frames chosen by {' and '.join(chose)}")
        if trial.get("forces_foretold"):
            parts.append("no force counts: forces and torques are foretold from the motion, without residual")
        heldout = trial["heldout"]
        if heldout is not None:
            linear, angular = heldout["linear_residual"], heldout["angular_residual"]
            parts.append(
                f"on {heldout['frames']} frames whose force was withheld {linear['rms_N']:.1f} N, "
                f"{angular['rms_Nm']:.1f} N·m{_markers_alone(heldout)}"
            )
            if heldout.get("learnt"):
                own = heldout["motion_only_linear_residual"], heldout["motion_only_angular_residual"]
                parts.append(
                    f"foretold with learnt {', '.join(heldout['learnt'])}, by its own motion "
                    f"{own[0]['rms_N']:.1f} N, {own[1]['rms_Nm']:.1f} N·m"
                )
        if parts:
            yield Text(f"{trial['name']}: {'; '.join(parts)}")
        yield from (Text(f"{trial['name']}: {words}") for words in stored_words(trial.get("stored", ())))
        yield from _withheld(trial)


def _withheld(trial: dict[str, Any]) -> Iterator[Text]:
    """A trial's layouts of withheld forces so far, and where the fit is worse than the markers alone."""
    for said in withheld_words(trial):
        yield Text(f"{trial['name']}: {said}")
    for said in worse_words(trial):
        yield Text(f"{trial['name']}: {said}", style="red")


def _markers_alone(heldout: dict[str, Any]) -> str:
    """Of the first layout; an older version's markers are no fair comparison, and not shown."""
    cutoffs = heldout.get("markers_cutoff_hz")
    if cutoffs is None:
        return ""
    linear, angular = heldout["kinematics_only_linear_residual"], heldout["kinematics_only_angular_residual"]
    return f" (markers alone at {cutoff_words(cutoffs)} {linear['rms_N']:.1f} N, {angular['rms_Nm']:.1f} N·m)"


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
