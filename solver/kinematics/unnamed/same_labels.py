"""Whether a label means the same marker in every recording: what is rigid in one is so in the others."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers

FRAMES = 60  # of each recording
RIGID_M = 0.008  # deviation of a distance over time
NEAR_M = 0.6  # two markers of one segment are not further apart
SAME_M = 0.025  # skin and posture move distances within a segment by less
FEWEST_PAIRS = 10  # rigid in both recordings; fewer tell nothing
AGREE = 0.6  # of them, at least


def disagreeing(recordings: Sequence[Markers]) -> str | None:
    """Two recordings whose labels name different markers, in words; None where all agree.

    Args:
        recordings: of one subject.
    """
    measured = [_distances(markers) for markers in recordings]
    for (i, (mean_a, rigid_a)), (j, (mean_b, rigid_b)) in combinations(enumerate(measured), 2):
        shared = [n for n in recordings[i].names if n in recordings[j].names]
        a = np.ix_(*[[recordings[i].names.index(n) for n in shared]] * 2)
        b = np.ix_(*[[recordings[j].names.index(n) for n in shared]] * 2)
        pairs = np.triu(rigid_a[a] & rigid_b[b], k=1)
        near = (np.minimum(mean_a[a], mean_b[b]) < NEAR_M) & pairs
        if near.sum() < FEWEST_PAIRS:
            continue
        same = np.abs(mean_a[a] - mean_b[b])[near] < SAME_M
        if same.mean() < AGREE:
            return (
                f"between recordings {i + 1} and {j + 1}, {np.sum(~same)} of {len(same)} distances within "
                "segments differ"
            )
    return None


def _distances(
    markers: Markers,
) -> tuple[Float[np.ndarray, "markers markers"], Bool[np.ndarray, "markers markers"]]:
    """Mean distance of every two markers [m], and whether it stays."""
    frames = np.unique(np.linspace(0, markers.frames - 1, min(FRAMES, markers.frames)).astype(int))
    x = markers.positions_ground[frames]
    distance = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
    seen = np.isfinite(distance)
    count = np.maximum(1, seen.sum(axis=0))
    mean = np.where(seen, distance, 0.0).sum(axis=0) / count
    deviation = np.sqrt((np.where(seen, distance - mean, 0.0) ** 2).sum(axis=0) / count)
    return mean, (deviation < RIGID_M) & (seen.sum(axis=0) > 1)
