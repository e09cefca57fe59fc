"""Which frames of long trials are fitted at a time: to learn the inertias by, and window by window.

All trials of a subject are one problem as long as they have no more than `whole_frames` together. Beyond it,
inertias are learnt from some of the frames. With these fixed no trial knows of another one, and no moment of
others that are seconds away: windows that overlap by as much agree in the middle of what they share.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from solver.common.frames_at_once import overlapping
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData

LEAST_ACTION = 0.1  # of a column's largest value, from which on a stretch tells its x


@dataclass(frozen=True)
class Span:
    """Frames `start` to `end` (excluded) of one of several trials."""

    trial: int
    start: int
    end: int

    @property
    def frames(self) -> int:
        """How many they are."""
        return self.end - self.start


def are_long(frames: Sequence[int], settings: TrajectorySettings) -> bool:
    """Whether trials of so many frames are too long together to be fitted as one problem."""
    return sum(frames) > settings.whole_frames


def teaching_spans(
    trials: Sequence[TrialData], align: Sequence[int], settings: TrajectorySettings
) -> list[Span]:
    """Frames that inertias and x are learnt from, of all trials alike, and of all times of a trial.

    Every trial gives as many, or all that it has; where that would be too few of each, those with the most
    frames that count go first. A trial gives stretches from equal parts of it: of each part the one with the
    most frames that count. Where a column of x does nothing in any of them, the stretch in which it does most
    comes along.

    Args:
        trials: of the fit.
        align: by trial, starts are its multiples.
        settings: how many frames, and how many in a stretch.
    """
    counts = [trial.counts for trial in trials]
    stretch, most = settings.stretch_frames, settings.inertia_frames
    order = sorted((i for i, c in enumerate(counts) if c.any()), key=lambda i: -int(counts[i].sum()))
    order = order[: max(1, most // min(stretch, most))]
    given: dict[int, int] = {}
    for k, i in enumerate(sorted(order, key=lambda i: len(counts[i]))):  # what short ones leave, others get
        given[i] = min(len(counts[i]), (most - sum(given.values())) // (len(order) - k))
    spans = [span for i in sorted(given) for span in _stretches(i, counts[i], given[i], align[i], stretch)]
    return _with_all_columns(spans, trials, align, stretch)


def _stretches(
    trial: int, counts: Bool[np.ndarray, " frames"], frames: int, align: int, stretch: int
) -> list[Span]:
    if frames == len(counts):
        return [Span(trial, 0, frames)]
    pieces = max(1, frames // stretch)
    length, before = frames // pieces, np.concatenate([[0], np.cumsum(counts)])
    spans = []
    for piece in range(pieces):
        low, high = (len(counts) * k // pieces for k in (piece, piece + 1))
        starts = np.arange(-(-low // align) * align, max(low, high - length) + 1, align)
        if len(starts):
            start = int(starts[np.argmax(before[starts + length] - before[starts])])
            spans.append(Span(trial, start, start + length))
    return spans


def _with_all_columns(
    spans: list[Span], trials: Sequence[TrialData], align: Sequence[int], stretch: int
) -> list[Span]:
    columns = [
        np.zeros((len(t.counts), 0))
        if t.extra_columns_ground is None
        else np.abs(t.extra_columns_ground).max(axis=1) * t.counts[:, None]
        for t in trials
    ]
    for x in range(max(acts.shape[1] for acts in columns)):
        own = [acts[:, x] if acts.shape[1] else np.zeros(len(acts)) for acts in columns]
        most = max(range(len(own)), key=lambda i: float(own[i].max(initial=0.0)))
        least = LEAST_ACTION * own[most].max(initial=0.0)
        if not least or any((own[s.trial][s.start : s.end] >= least).any() for s in spans):
            continue
        start = max(0, int(own[most].argmax()) - stretch // 2) // align[most] * align[most]
        spans = unite_spans([*spans, Span(most, start, min(len(own[most]), start + stretch))])
    return spans


def unite_spans(spans: Sequence[Span]) -> list[Span]:
    """In order, those that overlap as one."""
    together: list[Span] = []
    for span in sorted(spans, key=lambda s: (s.trial, s.start)):
        if together and together[-1].trial == span.trial and span.start <= together[-1].end:
            together[-1] = replace(together[-1], end=max(together[-1].end, span.end))
        else:
            together.append(span)
    return together


def windows(trial: int, frames: int, align: int, settings: TrajectorySettings) -> list[Span]:
    """A long subject's trial in overlapping windows of equal length; a single one if it is short enough.

    Args:
        trial: which.
        frames: of it.
        align: starts are its multiples.
        settings: how long trials may be, and windows and what they share.
    """
    parts = overlapping(
        frames,
        most=settings.window_frames,
        window=settings.window_frames,
        shared=settings.overlap_frames,
        align=align,
    )
    return [Span(trial, part.start, part.stop) for part in parts]
