"""The Fit tab: how good the fit is, what forces changed, what was assumed."""

import html
from collections.abc import Sequence

import viser

from addb_viewer.app.subjects.library import Library
from addb_viewer.text.amounts import kilograms
from addb_viewer.text.change_words import (
    READING,
    band_in_words,
    change_sentence,
    largest_first,
    signed,
)
from addb_viewer.text.coordinate_words import coordinate_in_words
from addb_viewer.text.held_out_words import (
    cutoff_words,
    layouts_judged,
    quantities,
    worse_words,
)
from addb_viewer.text.judged_figures import judged_figures
from addb_viewer.text.note_words import NotesOfKind, by_kind
from addb_viewer.text.plain_words import in_plain_words
from addb_viewer.trial_view.html_pieces import boxed, table
from addb_viewer.trial_view.replay import Replay
from solver.common.notes import Note
from solver.fitting.fit_summary import ChangeFigures, TrialFigures

TITLE = "font-weight:700;margin-top:.4em"
UNFOLDED = 3  # notes of a kind that are shown without a click

MOST_CHANGED = 12  # coordinates in the panel, which is narrow; the report has all


class FitTab:
    """What one browser shows of the fit of the trial on its screen."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        """Lay out the tab."""
        with tab:
            self.summary = gui.add_html("")
            self.of_change = gui.add_folder("What the fit to forces changed", expand_by_default=False)
            with self.of_change:
                self.change = gui.add_html("")
            with gui.add_folder("Notes"):
                self.notes = gui.add_html("")

    def show(self, library: Library, replay: Replay) -> None:
        """Show what is known now.

        Args:
            library: with the fit on the screen, if any.
            replay: of the trial.
        """
        fit, subject = library.fit, library.subject
        mass, height = (fit.mass_kg, fit.height_m) if fit else (subject.mass_kg, subject.height_m)
        person = {k: v for k, v in (("mass_kg", mass), ("height_m", height)) if v is not None}
        if fit and fit.mass_std:
            person["mass_std_kg"] = fit.mass_std.body_kg
        figures = library.figures(replay.name)
        self.summary.content = summary_html(figures, person, replay)
        self.of_change.visible = figures is not None
        self.change.content = change_html(figures and figures.change)
        self.notes.content = notes_html((*library.notes, *replay.notes))


def summary_html(figures: TrialFigures | None, person: dict[str, float], replay: Replay) -> str:
    """The trial's figures, with a mark for each limit kept or passed; what was not computed is left out."""
    rows = [("Frames", f"{replay.frames} at {replay.rate:g} Hz"), *person_rows(person)]
    if figures is None:
        return boxed(table(rows) + "<p>Not fitted yet.</p>")
    return boxed(table(rows + _figure_rows(figures)))


def person_rows(person: dict[str, float]) -> list[tuple[str, str]]:
    """Mass and height."""
    told = {}
    if "mass_kg" in person:
        told["Mass"] = kilograms(person["mass_kg"], person.get("mass_std_kg"))
    if "height_m" in person:
        told["Height"] = f"{person['height_m']:.2f} m"
    return list(told.items())


def change_html(change: ChangeFigures | None) -> str:
    """What the fit to forces changed in the motion, the largest changes first.

    Args:
        change: of the trial; None where nothing was fitted to forces.
    """
    told = change_sentence(change)
    if change is None or not told:
        return boxed("The motion is that of the markers alone.")
    band = next(i for i, (_, high) in enumerate(change.bands_hz) if high == change.limit_hz)
    gain_head = f"gain at {band_in_words(change.bands_hz[band])}"
    rows = []
    for c in largest_first(change)[:MOST_CHANGED]:
        unit, digits = ("°", 1) if c.unit == "deg" else ("\u00a0mm", 0)
        gain = c.gains[band]
        rows.append(
            (
                coordinate_in_words(c.name),
                f"{c.rms:.{digits}f}{unit}",
                f"{signed(c.offset, digits)}{unit}",
                f"{gain.gain:.2f}" if gain else "–",
            )
        )
    return boxed(
        f"<p>{html.escape(told)}.</p>{table(rows, ('coordinate', 'RMS', 'constant', gain_head))}"
        f"<p>{html.escape(READING)} All coordinates and bands: in the report.</p>"
    )


def notes_html(notes: Sequence[Note]) -> str:
    """What was assumed or ignored, folded by kind; open where somebody has to decide on a few."""
    if not notes:
        return boxed("Nothing was assumed or ignored.")
    kinds = by_kind(notes)
    parts = []
    for decide, title in ((True, "To look at"), (False, "Good to know")):
        own = [found for found in kinds if found.needs_decision is decide]
        if own:
            parts.append(f"<div style='{TITLE}'>{title}</div>" + "".join(map(_folded, own)))
    return boxed("".join(parts))


def _folded(found: NotesOfKind) -> str:
    is_open = found.needs_decision and len(found.notes) <= UNFOLDED
    summary = html.escape(in_plain_words(found.heading[0].upper() + found.heading[1:]))
    return (
        f"<details{' open' * is_open} style='margin:.2em 0'>"
        f"<summary style='cursor:pointer'>{summary}</summary>{_items(found.notes)}</details>"
    )


def _items(notes: Sequence[Note]) -> str:
    items = "".join(f"<li>{html.escape(in_plain_words(note))}</li>" for note in notes)
    return f"<ul style='padding-left:1.2em;margin:.1em 0 .3em;overflow-wrap:anywhere'>{items}</ul>"


def _figure_rows(figures: TrialFigures) -> list[tuple[str, str]]:
    marks = {None: "", True: "\u00a0✓", False: "\u00a0✗"}
    rows = [(each.label, each.words + marks[each.within]) for each in judged_figures(figures) if each.value]
    if figures.forces_predicted:
        rows.append(("Forces and torques", "predicted from the motion: no residual"))
    change = figures.change
    if change and change.joints_rms_deg is not None:
        rows.append(("Joints moved", f"{change.joints_rms_deg:.1f}° RMS by forces"))
        if gain := change.joints_gain:
            rows.append((f"Gain, {band_in_words(gain.band_hz)}", f"{gain.gain:.2f} of the markers' motion"))
    rows.append(("Frames counted", f"{figures.frames_with_force_used} (force known)"))
    return rows + _held_out_rows(figures)


def _held_out_rows(figures: TrialFigures) -> list[tuple[str, str]]:
    """Forces that the fit was not shown, beside what the markers alone predict; where these do better, ✗."""
    rows = []
    for words, found in layouts_judged(figures):
        for quantity, unit, of in quantities(found):
            mark = "" if of.ratio is None else " ✗" if of.ratio > 1 else " ✓"
            told = f"{of.rms:.1f} {unit}{mark}"
            told += f" (markers {of.markers_rms:.1f} at {cutoff_words(of.markers_cutoffs_hz)})"
            rows.append((f"Held-out {words}, {quantity}", told))
    worse = "worse than markers alone "
    return rows + [(worse.strip().capitalize(), said.removeprefix(worse)) for said in worse_words(figures)]
