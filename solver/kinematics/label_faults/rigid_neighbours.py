"""Which distances between markers stay the same over a recording, and how far off a point is by them.

Stretches on which labels are wrong, bounded by frames on which they are clearly right.

How far a label moves at once, beyond its neighbours: the one that does has changed trajectories.

Distances alone cannot tell the front pair of a pelvis exchanged from the rear pair: both give its mirror
image.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from solver.capture.marker_cleaning import SEGMENT_REACH_M
from solver.kinematics.label_faults.settings import (
    CLEAR_SHARE,
    EXCHANGED_BACK_SHARE,
    FEWEST_FRAMES,
    LOOSEST_HOLD_M,
    RIGID_M,
)
from solver.skeleton.skeleton import Skeleton

RIGID_ACROSS_M = 0.01  # [m] likewise to the next body, where joints bend: used where the own body has too few
HOLD_M = 0.012  # [m] distances off by less hold (RMS over neighbours), or by twice the marker's median
MOST_SHARE = 0.4  # of the frames: what holds for most of them is assumed to be right
FEWEST_NEIGHBOURS = 2  # distances that tell a place; one alone is wrong when its other end is
STEP_FRAMES = 2  # [frames] a label changes trajectories at once; what takes longer is movement
LONGEST_GAP_S = 1.0  # [s] a fault begins or ends in a gap no longer than that, or at a step

NORMAL = 1.4826  # standard deviation over median absolute deviation of a normal distribution

UNKNOWN, RIGHT, UNCLEAR, WRONG = 0, 1, 2, 3  # what a frame's distances say of a label


@dataclass(frozen=True, eq=False)
class RigidNeighbours:
    """Markers with the distances that they usually keep to one another."""

    points_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen
    usual_m: Float[np.ndarray, "markers markers"]  # [m] NaN where a distance is not kept
    fewest_neighbours: int = FEWEST_NEIGHBOURS
    longest_gap_s: float = LONGEST_GAP_S

    def of(self, marker: int, without: Sequence[int] = ()) -> Int[np.ndarray, " neighbours"]:
        """Markers whose distance to this one is kept."""
        near = np.flatnonzero(np.isfinite(self.usual_m[marker]))
        return near[~np.isin(near, without)]

    @cached_property
    def seen(self) -> Bool[np.ndarray, "frames markers"]:
        """Where each was seen."""
        return np.isfinite(self.points_ground).all(axis=2)

    @cached_property
    def hold_m(self) -> Float[np.ndarray, " markers"]:
        """Within which each marker's distances hold [m], RMS over its neighbours."""
        limits = np.zeros(self.usual_m.shape[0])
        for m in range(len(limits)):
            off, _ = self.off_m(m, self.points_ground[:, m], trust=False)
            known = off[np.isfinite(off)]
            limits[m] = 2 * np.median(known) if len(known) else 0.0
        return np.clip(limits, HOLD_M, LOOSEST_HOLD_M)

    def off_m(
        self,
        marker: int,
        points_ground: Float[np.ndarray, "frames 3"],
        without: Sequence[int] = (),
        *,
        trust: bool = True,
    ) -> tuple[Float[np.ndarray, " frames"], Int[np.ndarray, " frames"]]:
        """How far distances would be off with the marker at these points [m], RMS over its neighbours.

        Args:
            marker: whose usual distances count.
            points_ground: where it is taken to be [m].
            without: markers whose distances do not count.
            trust: count only neighbours that stay with their own neighbours.

        Returns:
            The RMS, NaN where too few distances are known; and how many are.
        """
        deviation = self.deviation_m(marker, points_ground, without, trust=trust)
        counts = np.isfinite(deviation)
        known = counts.sum(axis=1)
        total = (np.where(counts, deviation, 0.0) ** 2).sum(axis=1)
        enough = known >= self.fewest_neighbours
        return np.where(enough, np.sqrt(total / np.maximum(known, 1)), np.nan), known

    def deviation_m(
        self,
        marker: int,
        points_ground: Float[np.ndarray, "frames 3"],
        without: Sequence[int] = (),
        *,
        trust: bool = True,
    ) -> Float[np.ndarray, "frames neighbours"]:
        """Distances less the usual ones [m], NaN where unknown; arguments as in `off_m`."""
        near = self.of(marker, (marker, *without))
        distance = np.linalg.norm(self.points_ground[:, near] - points_ground[:, None], axis=2)
        deviation = distance - self.usual_m[marker, near]
        if trust:
            for i, j in enumerate(near):
                deviation[~self._trusted(j, (marker, *without)), i] = np.nan
        return deviation

    def _trusted(self, marker: int, without: Sequence[int]) -> Bool[np.ndarray, " frames"]:
        """Frames on which at least half of a marker's distances to others hold, or none is known."""
        near = self.of(marker, without)
        distance = np.linalg.norm(self.points_ground[:, near] - self.points_ground[:, marker, None], axis=2)
        off = np.abs(distance - self.usual_m[marker, near])
        known = np.isfinite(off).sum(axis=1)
        with np.errstate(invalid="ignore"):
            kept = (off < LOOSEST_HOLD_M).sum(axis=1)
        return self.seen[:, marker] & ((2 * kept >= known) & ((kept > 0) | (known == 0)))


def rigid_neighbours(
    points_ground: Float[np.ndarray, "frames markers 3"], skeleton: Skeleton
) -> RigidNeighbours:
    """Find the distances that most frames agree on, within segments and, where these are few, to the next.

    Args:
        points_ground: one trial's [m], NaN where unseen.
        skeleton: whose markers they are, in this order.
    """
    one, usual = on_one_segment(skeleton), np.full((len(skeleton.markers),) * 2, np.nan)
    for a, b in np.argwhere(np.triu(on_near_segments(skeleton), 1)):
        distance = np.linalg.norm(points_ground[:, a] - points_ground[:, b], axis=1)
        distance = distance[np.isfinite(distance)]
        if len(distance) < 2 * FEWEST_FRAMES:
            continue
        middle = np.median(distance)
        scatter = NORMAL * np.median(np.abs(distance - middle))
        most = RIGID_M if one[a, b] else RIGID_ACROSS_M
        if scatter < most and middle < SEGMENT_REACH_M:
            usual[a, b] = usual[b, a] = middle
    own = (np.isfinite(usual) & one).sum(axis=1)
    enough = own > FEWEST_NEIGHBOURS  # as many are left without the one it may be exchanged with
    return RigidNeighbours(points_ground, np.where(enough[:, None] & ~one, np.nan, usual))


def on_one_segment(skeleton: Skeleton) -> Bool[np.ndarray, "markers markers"]:
    """Pairs of a skeleton's markers that sit on one body."""
    body = np.array([marker.body for marker in skeleton.markers], dtype=int)
    return body[:, None] == body[None, :]


def on_near_segments(skeleton: Skeleton) -> Bool[np.ndarray, "markers markers"]:
    """Pairs that sit on one body or on two between which no other body carries markers."""
    body = np.array([marker.body for marker in skeleton.markers], dtype=int)
    marked, near = set(body.tolist()), np.eye(len(skeleton.bodies), dtype=bool)
    for child in marked:
        parent = skeleton.joints[child].parent
        while parent >= 0 and parent not in marked:
            parent = skeleton.joints[parent].parent
        if parent >= 0:
            near[child, parent] = near[parent, child] = True
    return near[np.ix_(body, body)]


@dataclass(frozen=True)
class Stretch:
    """Frames start to end − 1 are wrong, `after_right` and `before_right` the right ones around them."""

    start: int
    end: int
    after_right: int | None  # None: wrong from the recording's start
    before_right: int | None  # None: wrong to its end


def stretches(
    state: Int8[np.ndarray, " frames"],
    off_m: Float[np.ndarray, " frames"],
    rate: float,
    longest_gap_s: float = LONGEST_GAP_S,
) -> list[Stretch]:
    """Wrong frames between two right ones, where they begin and end at once or in a gap.

    Args:
        state: of each frame.
        off_m: how far distances are off as recorded [m], NaN where unknown.
        rate: [Hz].
        longest_gap_s: at either end.
    """
    wrong, right = np.flatnonzero(state == WRONG), np.flatnonzero(state == RIGHT)
    most = MOST_SHARE * (state != UNKNOWN).sum()
    if len(wrong) < FEWEST_FRAMES or len(right) == 0 or len(wrong) > most:
        return []
    found = []
    place = np.searchsorted(right, wrong)  # wrong frames between the same two right ones are together
    for k in np.unique(place):
        own = wrong[place == k]
        stretch = Stretch(
            int(own[0]),
            int(own[-1]) + 1,
            int(right[k - 1]) if k > 0 else None,
            int(right[k]) if k < len(right) else None,
        )
        inside = state[stretch.start : stretch.end]
        clear = len(own) >= CLEAR_SHARE * (inside != UNKNOWN).sum()
        if len(own) >= FEWEST_FRAMES and clear and _bounded(stretch, state, off_m, rate, longest_gap_s):
            found.append(stretch)
    return found


def _bounded(
    stretch: Stretch,
    state: Int8[np.ndarray, " frames"],
    off_m: Float[np.ndarray, " frames"],
    rate: float,
    longest_gap_s: float,
) -> bool:
    """Whether both ends are a step, a gap, or the recording's end."""
    first, last = stretch.after_right, stretch.before_right
    for right, between, wrong in (
        (first, state[(-1 if first is None else first) + 1 : stretch.start], stretch.start),
        (last, state[stretch.end : last], stretch.end - 1),
    ):
        if (between == UNCLEAR).sum() > STEP_FRAMES:
            return False
        if right is None:
            continue
        if (between == UNKNOWN).sum() > longest_gap_s * rate:
            return False
        if off_m[right] > EXCHANGED_BACK_SHARE * off_m[wrong]:
            return False
    return True


def step_m(
    rigid: RigidNeighbours, places: tuple[int, int], frames: tuple[int, int], without: Sequence[int] = ()
) -> float:
    """From one column's place to another's some frames later, less what the neighbours moved [m].

    Args:
        rigid: the markers; neighbours are those of the first column.
        places: columns, before and after.
        frames: before and after; both columns are seen then.
        without: neighbours that do not count.
    """
    x, (before, after) = rigid.points_ground, frames
    near = rigid.of(places[0], without)
    moved = x[after, near] - x[before, near]
    moved = moved[np.isfinite(moved).all(axis=1)]
    common = np.median(moved, axis=0) if len(moved) else np.zeros(3)
    return float(np.linalg.norm(x[after, places[1]] - x[before, places[0]] - common))


def edges(
    rigid: RigidNeighbours, columns: Sequence[int], stretch: Stretch, rate: float
) -> list[tuple[int, int] | None]:
    """Frames across each end of a stretch on which all columns are seen, the earlier one first.

    The recording's own ends are none; None where the columns are not seen together soon enough.
    """
    seen = np.asarray(rigid.seen[:, list(columns)].all(axis=1))
    inside = np.flatnonzero(seen[stretch.start : stretch.end]) + stretch.start
    found: list[tuple[int, int] | None] = []
    for right, outside, pick in (
        (stretch.after_right, np.flatnonzero(seen[: stretch.start])[-1:], 0),
        (stretch.before_right, np.flatnonzero(seen[stretch.end :])[:1] + stretch.end, -1),
    ):
        if right is None:
            continue
        if not len(inside) or not len(outside):
            found.append(None)
            continue
        first, last = sorted((int(outside[0]), int(inside[pick])))
        near = last - first <= 1 + STEP_FRAMES + rigid.longest_gap_s * rate
        found.append((first, last) if near else None)
    return found
