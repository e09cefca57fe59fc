"""What all layouts of held-out forces say together: RMS of fit and markers, and how sure that is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from solver.dynamics.cross_validation.held_out import HeldOutBlocks

_DRAWS = 2000
_SHARE = 0.9  # of the interval
_FEWEST = 4  # places in time: fewer make no interval
_SEED = 0


@dataclass(frozen=True)
class AgainstMarkers:
    """Force [N] or moment [N·m] missed on held-out frames, RMS over all layouts."""

    fit: float
    markers: float
    cutoffs_hz: tuple[float, float]  # lowest and highest that layouts chose for the markers
    interval: tuple[float, float] | None  # 90 %, of fit / markers, over blocks; None: too few of them

    @property
    def ratio(self) -> float:
        """Above 1 the markers alone predict better."""
        return self.fit / self.markers if self.markers > 0 else float("inf")


def against_markers(blocks: Sequence[HeldOutBlocks]) -> tuple[AgainstMarkers, AgainstMarkers]:
    """Force and moment of one trial.

    Args:
        blocks: of every layout of one kind; at least one.
    """
    places = _places(blocks)
    frames = np.concatenate([b.frames for b in blocks])
    fit = np.concatenate([b.missed for b in blocks])
    markers = np.concatenate([b.markers_missed for b in blocks])
    intervals = _intervals(fit, markers, places)
    found = []
    for axis in (0, 1):
        cutoffs = [b.markers_hz[axis] for b in blocks]
        rms = [float(np.sqrt(missed[:, axis].sum() / frames.sum())) for missed in (fit, markers)]
        found.append(AgainstMarkers(rms[0], rms[1], (min(cutoffs), max(cutoffs)), intervals[axis]))
    return found[0], found[1]


def _places(blocks: Sequence[HeldOutBlocks]) -> Int[np.ndarray, " blocks"]:
    """Blocks of several layouts that lie over each other are one direct check, not two: where each begins."""
    ranges = np.concatenate([b.ranges for b in blocks])
    length = max(1, int(np.median(np.diff(ranges, axis=1))))
    return np.unique(ranges[:, 0] // length, return_inverse=True)[1]


def _intervals(
    fit: Float[np.ndarray, "blocks 2"],
    markers: Float[np.ndarray, "blocks 2"],
    places: Int[np.ndarray, " blocks"],
) -> list[tuple[float, float] | None]:
    """Bootstrap over places of the ratio of RMS."""
    count = int(places.max()) + 1
    if count < _FEWEST:
        return [None, None]
    summed = np.zeros((count, 4))
    np.add.at(summed, places, np.hstack([fit, markers]))
    drawn = np.random.default_rng(_SEED).integers(0, count, (_DRAWS, count))
    sums = summed[drawn].sum(axis=1)
    if not (sums[:, 2:] > 0).all():
        return [None, None]
    ratios = np.sqrt(sums[:, :2] / sums[:, 2:])
    low, high = np.quantile(ratios, [(1 - _SHARE) / 2, (1 + _SHARE) / 2], axis=0)
    return [(float(low[axis]), float(high[axis])) for axis in (0, 1)]
