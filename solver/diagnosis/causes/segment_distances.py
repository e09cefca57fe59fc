"""Which marker of a segment moved at an instant, by the distances between its markers; no body model.

A marker that slips changes its distances from the segment's other markers and leaves theirs as they are. A
segment that bends, soft tissue that swings, or a pose beyond the model changes none, or others as well.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from solver.diagnosis.causes.marker_effect import RESOLVED_M, SHIFT_STD_M
from solver.diagnosis.causes.scene import Scene

SPAN_S = 0.15  # of medians before and after
APART_S = 0.3  # changes nearer to the instant are not usual ones
AT_S = 0.03  # within which the instant is known
FALLBACK_STD_M = 0.004  # of a trial too short to show usual changes
FEWEST_USUAL = 5
FEWEST_SEEN = 0.5  # share of the frames


@dataclass(frozen=True, eq=False)
class SegmentDistances:
    """What the distances within one segment say of an instant."""

    markers: Int[np.ndarray, " markers"]  # of the segment, those that are seen
    gains: Float[np.ndarray, " markers"]  # [nats] for a slip of each, over nothing that happened
    predicted: float  # [nats] that the distances would show for the slip that was asked about
    among_others_m: float  # by how much distances that are not its own change at the instant, at most

    def gain(self, marker: int) -> float:
        """Of one marker's slip."""
        return float(self.gains[self.markers == marker][0])

    @property
    def likeliest(self) -> int:
        """The marker whose slip explains most."""
        return int(self.markers[np.argmax(self.gains)])


def segment_distances(
    scene: Scene, marker: int, frame: int, shift_body: Float[np.ndarray, "3"]
) -> SegmentDistances:
    """The markers of a marker's segment before and after a frame.

    Args:
        scene: markers as recorded.
        marker: that seems to slip, seen before and after.
        frame: first one after it.
        shift_body: by how much, in the segment's axes [m].
    """
    observed, body = scene.markers.observed_ground, int(scene.markers.body[marker])
    seen = np.isfinite(observed).all(axis=2).mean(axis=0) >= FEWEST_SEEN
    own = np.flatnonzero((scene.markers.body == body) & (seen | (np.arange(len(seen)) == marker)))
    in_body = np.einsum(
        "tji,tmj->tmi", scene.R_ground_body[:, body], observed[:, own] - scene.p_ground_body[:, body, None]
    )
    places = np.nanmedian(in_body, axis=0)
    pairs = list(combinations(range(len(own)), 2))
    if not pairs:
        return SegmentDistances(own, np.zeros(len(own)), 0.0, 0.0)
    found = [_change(observed[:, own[i]], observed[:, own[k]], frame, scene.rate) for i, k in pairs]
    change, std = np.array(found).T
    ends = np.array(pairs)
    apart = places[ends[:, 0]] - places[ends[:, 1]]
    along = apart / np.linalg.norm(apart, axis=1, keepdims=True)
    gains = []
    for m in range(len(own)):
        sign = (ends[:, 0] == m).astype(float) - (ends[:, 1] == m)
        gains.append(_gain(change / std, sign[:, None] * along / std[:, None], sign != 0))
        if own[m] == marker:
            moved = np.linalg.norm(apart + sign[:, None] * shift_body, axis=1) - np.linalg.norm(apart, axis=1)
    others = np.abs(change)[(own[ends] != marker).all(axis=1)]
    predicted = float(0.5 * ((moved / std) ** 2).sum())
    return SegmentDistances(own, np.array(gains), predicted, float(others.max(initial=0.0)))


def _gain(
    change: Float[np.ndarray, " pairs"],
    by_shift: Float[np.ndarray, "pairs 3"],
    its: Bool[np.ndarray, " pairs"],
) -> float:
    """Of a free shift of one marker; changes and slopes in standard deviations, in the pairs that are its."""
    y, A = change[its], by_shift[its]
    shift = np.linalg.solve(A.T @ A + np.eye(3) / SHIFT_STD_M**2, A.T @ y)
    left = y - A @ shift
    return float(0.5 * (y @ y - left @ left - shift @ shift / SHIFT_STD_M**2))


def _change(
    one_ground: Float[np.ndarray, "frames 3"],
    other_ground: Float[np.ndarray, "frames 3"],
    frame: int,
    rate: float,
) -> tuple[float, float]:
    """Of a distance at a frame, and the standard deviation of such changes elsewhere in the trial [m]."""
    count = max(2, round(SPAN_S * rate))
    edge = np.full(count, np.nan)
    distance = np.concatenate([edge, np.linalg.norm(one_ground - other_ground, axis=1), edge])
    windows = sliding_window_view(distance, count)
    known = np.isfinite(windows).any(axis=1)
    medians = np.full(len(windows), np.nan)
    medians[known] = np.nanmedian(windows[known], axis=1)
    changes = medians[count : count + len(one_ground)] - medians[: len(one_ground)]
    away = np.abs(np.arange(len(changes)) - frame)
    usual = np.abs(changes[(away > APART_S * rate) & np.isfinite(changes)])
    std = np.percentile(usual, 95) / 2 + RESOLVED_M if len(usual) >= FEWEST_USUAL else FALLBACK_STD_M
    near = changes[(away <= max(1, round(AT_S * rate))) & np.isfinite(changes)]
    return (float(near[np.argmax(np.abs(near))]) if len(near) else 0.0), float(std)
