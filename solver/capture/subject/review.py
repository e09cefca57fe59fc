"""Human review of a trial's forces as AddBiomechanics stores it: segment_K/review.json."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Markers
from solver.capture.subject.description import read_json
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

KEY = "missing_grf_data"


@dataclass(frozen=True)
class _Segment:
    """One segment's labels; `start` is the time of its first frame where data.csv tells it [s]."""

    place: Path
    missing: Bool[np.ndarray, " frames"]
    start: float | None


def imported_review(
    reviews: Sequence[Path], markers: Markers
) -> tuple[Bool[np.ndarray, " frames"] | None, Bool[np.ndarray, " frames"] | None, tuple[Note, ...]]:
    """Labels of a whole trial: true where a person said that the force is missing.

    A segment lies where the timestamps of its data.csv say; without them, segments follow one another from
    frame 0.

    Args:
        reviews: review.json of the segments, in order.
        markers: the trial that they are about.

    Returns:
        One boolean a frame, or None without reviews; which frames have a review, None where all have; and
        what was assumed.

    Raises:
        CaptureError: a review.json is broken.
    """
    if not reviews:
        return None, None, ()
    mask, covered = np.zeros(markers.frames, bool), np.zeros(markers.frames, bool)
    notes: list[Note] = []
    end, previous = 0, None
    for review in reviews:
        segment = _read(review)
        follows = end + _frames_between(previous, review)
        first = _first_frame(segment, follows, markers)
        end, previous = first + len(segment.missing), review
        name = f"{segment.place.name}/{review.name}"
        if end > markers.frames:
            notes += noted(
                Kind.OTHER,
                f"{name}: labels frames {first} to {end - 1}, but the trial has only {markers.frames}; "
                "labels beyond that are ignored",
            )
        inside = slice(min(first, markers.frames), min(end, markers.frames))
        mask[inside] = segment.missing[: inside.stop - inside.start]
        covered[inside] = True
        if not (segment.place / "REVIEWED").exists():
            notes += noted(
                Kind.REVIEWS, f"{name}: no file REVIEWED beside it: perhaps nobody has finished the review"
            )
    if not covered.all():
        notes += noted(
            Kind.REVIEWS, f"{int((~covered).sum())} frames have no review: detection decides about them"
        )
    return mask, None if covered.all() else covered, tuple(notes)


def _first_frame(segment: _Segment, follows: int, markers: Markers) -> int:
    """Where the timestamps put the segment, if that lies behind the one before and inside the trial."""
    if segment.start is None:
        return follows
    stamped = round((segment.start - markers.start_time) * markers.rate)
    return stamped if follows <= stamped <= markers.frames - len(segment.missing) else follows


def _read(review: Path) -> _Segment:
    labels = read_json(review).values.get(KEY)
    if not isinstance(labels, list) or not all(label in (True, False) for label in labels):
        raise CaptureError(f"{review}: '{KEY}' must be a list of true and false, one per frame.")
    times = _timestamps(review.parent / "data.csv")
    usable = len(times) == len(labels) > 1 and np.isfinite(times).all() and bool(np.all(np.diff(times) > 0))
    return _Segment(review.parent, np.array(labels, dtype=bool), float(times[0]) if usable else None)


def _timestamps(path: Path) -> np.ndarray:
    """The column `timestamp` [s]; NaN where it is no number, empty where there is no such column."""
    rows = _rows(path)
    column = (
        next((k for k, name in enumerate(rows[0]) if name.strip().lower() == "timestamp"), None)
        if rows
        else None
    )
    if column is None:
        return np.zeros(0)
    return np.array([_number(row[column]) if column < len(row) else math.nan for row in rows[1:]])


def _rows(path: Path) -> list[list[str]]:
    try:
        with path.open(newline="", encoding="utf-8-sig", errors="replace") as file:
            return [row for row in csv.reader(file) if row]
    except (OSError, csv.Error):
        return []


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _frames_between(previous: Path | None, review: Path) -> int:
    """Frames of the segments that were left without a review.json, as their data.csv counts them."""
    number = _segment_number(review)
    before = _segment_number(previous) if previous else 0
    if number is None or before is None:
        return 0
    skipped = (review.parent.parent / f"segment_{k}" / "data.csv" for k in range(before + 1, number))
    return sum(max(0, len(_rows(path)) - 1) for path in skipped)


def _segment_number(review: Path) -> int | None:
    match = re.fullmatch(r"segment_(\d+)", review.parent.name)
    return int(match[1]) if match else None
