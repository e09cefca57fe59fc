"""Leaps: markers whose own paths are cut at one instant, by the recording alone.

Distances within a segment show that one group of markers moved against another, and a pose goes with the
many; neither tells which group it was. The markers' own paths do, where it happened within a frame or two:
the path of a marker that was moved has a step, that of one that stayed has none. A person's markers speed up
and stop at impacts, which bends a path and does not cut it: a step has to describe it better than a bend.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view

HALF_S = 0.05  # of path on either side that one cubic describes, but for the step
FEWEST = 4  # samples of it
LEAST_M = 0.01  # bends of shanks and toes at an impact look like up to 30 mm, others' less than this
OVER_OTHER_STEPS = 2.5  # times the largest step elsewhere in the marker's path
# times what a step leaves, a bend does; of 14 sound trials' largest the median is 0.9, the most 1.8
BEND_OVER_STEP = 2.5
BENDS = (-0.5, -0.25, 0.0, 0.25, 0.5)  # where in the window one may be, in halves
AT_ONCE_S = 0.02  # leaps within are one event
ALIKE_SHARE = 0.3  # of the shift: markers whose steps differ by less go with those whose paths are surely cut
# of the step: as much shortly before or after takes it back; a step's own trace is 0.4
TAKEN_BACK_SHARE = 0.7
APART_S = 0.15  # steps farther away are others
LASTS_S = 0.3  # nearer to an end nobody knows whether it lasts


@dataclass(frozen=True, eq=False)
class Leap:
    """Markers that moved together at one instant, and stayed there."""

    markers: tuple[int, ...]
    frame: int  # first one after it
    shift_ground: Float[np.ndarray, "moved 3"]  # [m]
    std_m: float  # of a shift along one axis


def leaps(positions_ground: Float[np.ndarray, "frames markers 3"], rate: float) -> list[Leap]:
    """All of a recording, in the order of time.

    Args:
        positions_ground: as recorded, NaN where unseen [m].
        rate: frames per second [Hz].
    """
    paths = _Paths.of(positions_ground, rate)
    cut = sorted(found for m in range(positions_ground.shape[1]) if (found := paths.cut(m)))
    events: list[list[tuple[int, int]]] = []
    for frame, marker in cut:
        if events and frame - events[-1][-1][0] <= max(1, round(AT_ONCE_S * rate)):
            events[-1].append((frame, marker))
        else:
            events.append([(frame, marker)])
    return [paths.leap(event) for event in events]


@dataclass(frozen=True, eq=False)
class _Paths:
    """Steps of all paths at all frames, and what is left with them and with bends."""

    rate: float
    half: int
    windows: Float[np.ndarray, "starts markers 3 samples"]
    step_ground: Float[np.ndarray, "starts markers 3"]

    @classmethod
    def of(cls, positions_ground: Float[np.ndarray, "frames markers 3"], rate: float) -> "_Paths":
        half = max(FEWEST, round(HALF_S * rate))
        if len(positions_ground) < 2 * half:
            shape = (0, positions_ground.shape[1], 3)
            return cls(rate, half, np.empty((*shape, 2 * half)), np.empty(shape))
        windows = sliding_window_view(positions_ground, 2 * half, axis=0)
        return cls(rate, half, windows, windows @ np.linalg.pinv(_columns(half, None))[-1])

    def cut(self, marker: int) -> tuple[int, int] | None:
        """Frame and marker of the only step of a path that is one; None where there is none."""
        size = np.linalg.norm(self.step_ground[:, marker], axis=1)
        if not np.isfinite(size).any():
            return None
        at = int(np.nanargmax(size))
        offset = np.abs(np.arange(len(size)) - at)
        others = _largest(size[offset > max(2 * self.half, APART_S * self.rate)])
        back = _largest(size[(offset > AT_ONCE_S * self.rate) & (offset <= APART_S * self.rate)])
        seen = np.flatnonzero(np.isfinite(self.windows[:, marker, 0, self.half]))
        lasts = min(at - seen[0], seen[-1] - at) >= LASTS_S * self.rate - self.half
        if size[at] < max(LEAST_M, OVER_OTHER_STEPS * others, back / TAKEN_BACK_SHARE) or not lasts:
            return None
        step = self._left(at, marker, None)
        bend = min(self._left(at, marker, place) for place in BENDS)
        return (at + self.half, marker) if bend > BEND_OVER_STEP * step else None

    def leap(self, event: list[tuple[int, int]]) -> Leap:
        """The event of these steps, and of those that others make with them."""
        frame = int(np.median([frame for frame, _ in event]))
        steps = {m: f for f, m in event}
        shift = np.mean([self.step_ground[f - self.half, m] for f, m in event], axis=0)
        off = np.linalg.norm(self.step_ground[frame - self.half] - shift, axis=1)
        steps |= {
            int(m): frame for m in np.flatnonzero(off < ALIKE_SHARE * np.linalg.norm(shift)) if m not in steps
        }
        event = [(steps[m], m) for m in sorted(steps)]
        shifts = np.array([self.step_ground[f - self.half, m] for f, m in event])
        left = [self._left(f - self.half, m, None) for f, m in event]
        weights = np.linalg.pinv(_columns(self.half, None))[-1]
        free = 3 * (2 * self.half - 5)
        std = float(np.sqrt(np.mean(np.square(left)) / free) * np.linalg.norm(weights))
        return Leap(tuple(m for _, m in event), frame, shifts, std)

    def _left(self, at: int, marker: int, bend: float | None) -> float:
        """Norm of what a cubic and a step leave of a window, or a cubic and a bend [m]."""
        columns = _columns(self.half, bend)
        path = self.windows[at, marker].T
        return float(np.linalg.norm(path - columns @ np.linalg.lstsq(columns, path, rcond=None)[0])) + 1e-6


def _largest(sizes: Float[np.ndarray, " some"]) -> float:
    """Of those that are known [m]."""
    return float(np.nanmax(sizes)) if np.isfinite(sizes).any() else 0.0


def _columns(half: int, bend: float | None) -> Float[np.ndarray, "samples 5"]:
    """A cubic, and a step in the middle, or a bend."""
    t = (np.arange(-half, half) + 0.5) / half
    last = (t > 0).astype(float) if bend is None else np.maximum(t - bend, 0.0)
    return np.column_stack([*(t**power for power in range(4)), last])
