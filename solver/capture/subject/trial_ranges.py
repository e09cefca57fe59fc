"""Parts of a trial that are to be used, as the `trialRanges` of a _subject.json name them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from solver.capture.capture import Markers, TrialFiles
from solver.capture.subject.description import Entries
from solver.common.notes import Kind, Note, noted
from solver.common.runs import runs

KEY = "trialRanges"
Ranges = tuple[tuple[float, float], ...]  # [s] first and last time of each part


def trial_ranges(entries: Entries) -> dict[str, Ranges] | None:
    """By trial, the parts that count: `[t0, t1]`, or a list of such pairs; None where nothing is said.

    Raises:
        CaptureError: something else stands there.
    """
    named = entries.values.get(KEY)
    if not named:
        return None
    if not isinstance(named, Mapping):
        raise entries.complaint(KEY, 'ranges belong to trials: {"walk": [0.45, 2.0]}, in seconds.')
    of_trials = Entries(entries.path, named, f"{KEY}.")
    return {str(trial): _ranges(of_trials, trial) for trial in named}


def with_ranges(
    trials: Sequence[TrialFiles], ranges: Mapping[str, Ranges] | None
) -> tuple[tuple[TrialFiles, ...], tuple[Note, ...]]:
    """The trials, each with its own ranges; and a note on ranges of trials that are not there."""
    ranges = ranges or {}
    unknown = sorted(set(ranges) - {trial.name for trial in trials})
    notes = (
        noted(Kind.REVIEWS, f"{KEY}: no trial is called {', '.join(unknown)}; its range is not used")
        if unknown
        else ()
    )
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
            f"{KEY} ({named}) hold no frame of the trial ({markers.times[0]:g} to {markers.times[-1]:g} s): "
            "none of its forces is used. Correct them in _subject.json.",
        )
    listed = ", ".join(f"{start} to {end - 1}" for start, end in runs(outside))
    return outside, (
        noted(Kind.LEFT_OUT, f"forces of frames {listed} are not used: outside {KEY} ({named})")
        if listed
        else ()
    )


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
