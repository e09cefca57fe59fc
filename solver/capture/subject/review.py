"""Which frames' forces count, as files beside the recording say.

A human review as AddBiomechanics stores it (segment_K/review.json), and a trial's ranges in _subject.json.
"""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Markers, TrialFiles
from solver.capture.subject.description import Entries, read_json
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs

MISSING_KEY = "missing_grf_data"
RANGES_KEY = "trialRanges"
Ranges = tuple[tuple[float, float], ...]  # [s] first and last time of each part


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
    labels = read_json(review).values.get(MISSING_KEY)
    if not isinstance(labels, list) or not all(label in (True, False) for label in labels):
        raise CaptureError(f"{review}: '{MISSING_KEY}' must be a list of true and false, one per frame.")
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


def trial_ranges(entries: Entries) -> dict[str, Ranges] | None:
    """By trial, the parts that count: `[t0, t1]`, or a list of such pairs; None where nothing is said.

    Raises:
        CaptureError: something else stands there.
    """
    named = entries.values.get(RANGES_KEY)
    if not named:
        return None
    if not isinstance(named, Mapping):
        raise entries.complaint(RANGES_KEY, 'ranges belong to trials: {"walk": [0.45, 2.0]}, in seconds.')
    of_trials = Entries(entries.path, named, f"{RANGES_KEY}.")
    return {str(trial): _ranges(of_trials, trial) for trial in named}


def with_ranges(
    trials: Sequence[TrialFiles], ranges: Mapping[str, Ranges] | None
) -> tuple[tuple[TrialFiles, ...], tuple[Note, ...]]:
    """The trials, each with its own ranges; and a note on ranges of trials that are not there."""
    ranges = ranges or {}
    unknown = sorted(set(ranges) - {trial.name for trial in trials})
    listed = ", ".join(unknown)
    said = f"{RANGES_KEY}: no trial is called {listed}; its range is not used"
    notes = noted(Kind.REVIEWS, said) if unknown else ()
    return tuple(replace(trial, ranges=ranges.get(trial.name, ())) for trial in trials), notes


def outside_ranges(
    ranges: Ranges, markers: Markers
) -> tuple[Bool[np.ndarray, " frames"] | None, tuple[Note, ...]]:
    """Frames that lie in no range, and a note that lists them; None where the whole trial counts.

    A range holds its first and last time, to half a frame.

    Args:
        ranges: of the trial [s], on the recording's clock.
        markers: of the trial.
    """
    if not ranges:
        return None, ()
    half = 0.5 / markers.rate
    inside = [(markers.times >= start - half) & (markers.times <= end + half) for start, end in ranges]
    outside = ~np.any(inside, axis=0)
    named = ", ".join(f"{start:g} to {end:g} s" for start, end in ranges)
    if outside.all():
        return outside, noted(
            Kind.OTHER,
            f"{RANGES_KEY} ({named}) hold no frame of the trial ({markers.times[0]:g} to "
            f"{markers.times[-1]:g} s): none of its forces is used. Correct them in _subject.json.",
        )
    listed = ", ".join(f"{start} to {end - 1}" for start, end in runs(outside))
    said = f"forces of frames {listed} are not used: outside {RANGES_KEY} ({named})"
    return outside, noted(Kind.LEFT_OUT, said) if listed else ()


def _ranges(entries: Entries, trial: str) -> Ranges:
    value = entries.values[trial]
    if value is None or value == []:
        return ()
    pairs = value if isinstance(value, list) and isinstance(value[0], list) else [value]
    if not all(isinstance(pair, list) and len(pair) == 2 and all(map(_is_time, pair)) for pair in pairs):
        raise entries.complaint(trial, "two times in seconds are needed, as in [0.45, 2.0].")
    if not all(start < end for start, end in pairs):
        raise entries.complaint(trial, "a range must end after it begins.")
    return tuple((float(start), float(end)) for start, end in pairs)


def _is_time(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
