"""A quantity over the gait cycle: each stride from 0 to 100 %, and their mean."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.gait.cycles import Cycle

POINTS = 101  # from 0 to 100 %, a point a percent


@dataclass(frozen=True, eq=False)
class StrideCurves:
    """One quantity over the strides of one foot.

    Attributes:
        cycles: the strides that count.
        values: a row a stride; [strides, points].
        left_out: strides with a frame that has no value, or whose forces do not count.
        within: standard deviation within a stride, by the values' own: root mean square over the strides.
    """

    cycles: tuple[Cycle, ...]
    values: Float[np.ndarray, "strides points"]
    left_out: int
    within: Float[np.ndarray, " points"] | None = None

    @property
    def mean(self) -> Float[np.ndarray, " points"] | None:
        """Over the strides; None without any."""
        return self.values.mean(axis=0) if self.cycles else None

    @property
    def std(self) -> Float[np.ndarray, " points"] | None:
        """Standard deviation likewise, of the sample; None below two strides."""
        return self.values.std(axis=0, ddof=1) if len(self.cycles) > 1 else None

    @property
    def foot_off_share(self) -> float | None:
        """Mean share of the stride at which the foot leaves the ground; None where no stride tells it."""
        shares = [cycle.stance_share for cycle in self.cycles if cycle.stance_share is not None]
        return float(np.mean(shares)) if shares else None


def stretch_to_stride(
    cycle: Cycle,
    times: Float[np.ndarray, " frames"],
    values: Float[np.ndarray, " frames"],
    points: int = POINTS,
) -> Float[np.ndarray, " points"]:
    """A stride of a quantity, linearly between frames.

    Args:
        cycle: the stride.
        times: of the frames [s].
        values: at the frames.
        points: from 0 to 100 %, both included.
    """
    share = np.linspace(0.0, 1.0, points)
    return np.interp(cycle.start_s + share * (cycle.end_s - cycle.start_s), times, values)


def stride_curves(
    cycles: Iterable[Cycle],
    times: Float[np.ndarray, " frames"],
    values: Float[np.ndarray, " frames"],
    counts: Bool[np.ndarray, " frames"] | None = None,
    std: Float[np.ndarray, " frames"] | None = None,
) -> StrideCurves:
    """All strides of one foot; one counts if each of its frames has a value and counts.

    Args:
        cycles: of the foot.
        times: of the frames [s].
        values: at the frames; NaN where unknown.
        counts: frames whose forces count, for what rests on forces; None: all.
        std: standard deviations of the values; None: not known.
    """
    kept, rows, left_out = [], [], 0
    usable = np.isfinite(values) if counts is None else np.isfinite(values) & counts
    for cycle in cycles:
        first = max(int(np.searchsorted(times, cycle.start_s, side="right")) - 1, 0)
        last = min(int(np.searchsorted(times, cycle.end_s, side="left")), len(times) - 1)
        if not usable[first : last + 1].all():
            left_out += 1
            continue
        kept.append(cycle)
        rows.append(stretch_to_stride(cycle, times, values))
    within = None if std is None else np.full(POINTS, np.nan)
    if std is not None and kept:
        squares = [stretch_to_stride(cycle, times, std) ** 2 for cycle in kept]
        within = np.sqrt(np.mean(squares, axis=0))
    return StrideCurves(tuple(kept), np.array(rows).reshape(len(rows), POINTS), left_out, within)
