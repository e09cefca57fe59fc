"""A fit's figures against the bounds of the field."""

import warnings
from collections.abc import Sequence

import numpy as np

from addb_viewer.report.markup import Safe, bar, element, joined, table, verdict_mark
from addb_viewer.text.held_out_words import (
    cutoff_words,
    layouts_judged,
    pieces_words,
    quantities,
    worse_words,
)
from addb_viewer.text.judged_figures import Judged, figure_words, judged_figures, length_words
from addb_viewer.text.stored_words import stored_words
from addb_viewer.trial_view.replay import Replay
from solver.common.gravity import GRAVITY
from solver.dynamics.thresholds import Thresholds
from solver.fitting.fit_summary import TrialFigures

MOST = 8


def bounds_of(mass_kg: float, height_m: float) -> tuple[float, float]:
    """The bounds of a person's residual force [N] and moment [N·m]."""
    limits, weight = Thresholds(), mass_kg * GRAVITY
    return limits.linear_BW * weight, limits.angular_BWh * weight * height_m


def quality_table(trials: Sequence[TrialFigures]) -> Safe:
    """A row a trial, a column a figure."""
    judged = [judged_figures(figures) for figures in trials]
    head = ["Trial", *(joined((j.label, element("small", f"bound {j.bound}"))) for j in judged[0])]
    rows = [
        [figures.name, *(_cell(j) for j in of_trial)]
        for figures, of_trial in zip(trials, judged, strict=True)
    ]
    return table(head, rows, "quality")


def held_out_table(trials: Sequence[TrialFigures]) -> Safe | None:
    """How well forces are predicted that the fit was not shown; None where none were held out."""
    rows = [row for figures in trials for row in _layout_rows(figures)]
    head = (
        "Trial",
        "Held out",
        "Frames",
        "Force missed",
        "by markers alone",
        "Moment missed",
        "by markers alone",
        "Marker error, RMS",
    )
    return table(head, rows) if rows else None


def worse_than_markers(trials: Sequence[TrialFigures]) -> Safe | None:
    """Where the markers alone predict held-out forces better than the fit; None where they nowhere do."""
    said = [f"{figures.name}: {words}." for figures in trials for words in worse_words(figures)]
    return element("ul", *(element("li", words) for words in said)) if said else None


def stored_list(trials: Sequence[TrialFigures]) -> Safe | None:
    """What recordings say of themselves, beside the table of what was found; None where they say nothing."""
    said = [f"{figures.name}: {words}." for figures in trials for words in stored_words(figures.stored)]
    return element("ul", *(element("li", words) for words in said)) if said else None


def _layout_rows(figures: TrialFigures) -> list[list[str]]:
    rows = []
    for words, found in layouts_judged(figures):
        pieces, layouts = pieces_words(found, words)
        row = [figures.name, f"{pieces} in {layouts}", str(found.frames)]
        for _, unit, of in quantities(found):
            alone = f"{figure_words(of.markers_rms, unit, 1)} at {cutoff_words(of.markers_cutoffs_hz)}"
            row += [figure_words(of.rms, unit, 1), alone]
        rows.append([*row, _marker_errors(figures)])
    return rows


def _marker_errors(figures: TrialFigures) -> str:
    """Now, and before forces were looked at."""
    alone = figures.kinematics_only
    before = length_words(alone.marker_rms_m) if alone else ""
    return f"{length_words(figures.marker_rms_m)} ({before} markers alone)"


def _cell(judged: Judged) -> Safe:
    if judged.within is None:
        return verdict_mark(None)
    tone = "good" if judged.within else "bad"
    below = f"{judged.scaled}{', ' if judged.scaled else ''}{100 * (judged.share or 0.0):.0f} % of the bound"
    return joined(
        (
            element("b", judged.value),
            Safe(" "),
            verdict_mark(judged.within),
            bar(judged.share or 0.0, tone),
            element("small", below),
        )
    )


def worst_markers(replay: Replay, index: int) -> Safe:
    """The markers with the largest RMS error, worst first.

    Args:
        replay: the trial.
        index: of it in the report.
    """
    errors = replay.markers.errors
    compared = np.flatnonzero(np.isfinite(errors).any(axis=0))
    if not len(compared):
        return element("p", "No marker of this trial is in the model.")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # markers that were never seen
        rms = np.sqrt(np.nanmean(errors**2, axis=0))
    worst = compared[np.argsort(-rms[compared])][:MOST]
    most = float(rms[worst[0]])
    rows = []
    for marker in worst:
        frame = int(np.nanargmax(errors[:, marker]))
        seen = float(np.isfinite(replay.markers.measured[:, marker]).all(axis=1).mean())
        largest = float(errors[frame, marker])
        rows.append(
            [
                replay.markers.names[marker],
                element(
                    "span",
                    bar(rms[marker] / most),
                    Safe(" "),
                    f"{100 * rms[marker]:.2f} cm",
                    class_="measured",
                ),
                f"{100 * largest:.1f} cm{' ✗' if largest > Thresholds().marker_max_m else ''}",
                seek_link(index, frame, f"frame {frame}, {replay.times[frame]:.2f} s"),
                f"{100 * seen:.0f} %",
            ]
        )
    return table(("Marker", "RMS", "Largest", "at", "Seen"), rows)


def seek_link(trial: int, frame: int, words: str) -> Safe:
    """A link that leads the player to a frame."""
    return element("a", words, href="#scene", data_seek=f"{trial}:{frame}")
