"""The frames of a trial as a table: where they count, and why not elsewhere."""

import numpy as np
from jaxtyping import Float

from addb_viewer.report.frames_kept import (
    Kept,
    decided_by,
    duration_s,
    frames_words,
    seconds_words,
)
from addb_viewer.report.markup import Safe, element, joined, swatch, table
from addb_viewer.report.worst_markers import seek_link
from addb_viewer.trial_view.palette import GREEN, reason_color
from addb_viewer.trial_view.recorded_subject import TrialRecord


def frames_part(record: TrialRecord, kept: Kept, index: int) -> Safe:
    """A sentence and a table.

    Args:
        record: the trial.
        kept: its frames.
        index: of it in the report.
    """
    replay = record.replay
    rows = [
        (
            joined((swatch(GREEN), Safe(" "), "usable")),
            "both feet",
            *_sizes(kept.ranges, kept.count, kept.frames, replay.rate),
            _places(kept.ranges, replay.times, index),
        )
    ]
    for cause in kept.causes:
        rows.append(
            (
                joined(
                    (
                        swatch(reason_color(cause.reason)),
                        Safe(" "),
                        f"left out: {cause.words}",
                        _meaning(cause.meaning),
                    )
                ),
                cause.foot_words,
                *_sizes(cause.ranges, cause.frames, kept.frames, replay.rate),
                _places(cause.ranges, replay.times, index),
            )
        )
    said = [f"{kept.count} of {kept.frames} frames are usable ({_seconds(kept.ranges, replay.rate)})."]
    if kept.contacts is not None:
        measured, of = kept.contacts
        said.append(f"Plates carry the foot in {measured} of the {of} times that one stands on the ground.")
    said.append(f"Who decided: {decided_by(record.figures.mask_source, kept)}.")
    head = ("Frames are …", "Foot", "Frames", "Time", "Where: frames, seconds on the recording's clock")
    return joined((element("p", " ".join(said)), table(head, rows, "frames")))


def _meaning(words: str) -> Safe:
    return element("small", words) if words else Safe("")


def _sizes(ranges: tuple[tuple[int, int], ...], count: int, of: int, rate: float) -> tuple[Safe, str]:
    share = element("small", f"{100 * count / max(of, 1):.0f} %")
    return joined((str(count), Safe(" "), share)), _seconds(ranges, rate)


def _seconds(ranges: tuple[tuple[int, int], ...], rate: float) -> str:
    return f"{duration_s(ranges, rate):.2f} s"


def _places(ranges: tuple[tuple[int, int], ...], times: Float[np.ndarray, " frames"], index: int) -> Safe:
    """Each range with a link to its first frame."""
    if not ranges:
        return Safe("nowhere")
    return joined(
        (
            element(
                "span",
                seek_link(index, start, frames_words(start, end)),
                Safe(" "),
                element("small", seconds_words(start, end, times)),
                class_="range",
            )
            for start, end in ranges
        ),
        between=" ",
    )
