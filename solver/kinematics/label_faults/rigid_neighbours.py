"""Which distances between markers stay the same over a recording, and how far off a point is by them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.kinematics.label_faults.settings import LabelRepairSettings
from solver.skeleton.skeleton import Skeleton

NORMAL = 1.4826  # standard deviation over median absolute deviation of a normal distribution


@dataclass(frozen=True, eq=False)
class RigidNeighbours:
    """Markers with the distances that they usually keep to one another."""

    points_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen
    usual_m: Float[np.ndarray, "markers markers"]  # [m] NaN where a distance is not kept
    settings: LabelRepairSettings

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
        settings, limits = self.settings, np.zeros(self.usual_m.shape[0])
        for m in range(len(limits)):
            off, _ = self.off_m(m, self.points_ground[:, m], trust=False)
            known = off[np.isfinite(off)]
            limits[m] = 2 * np.median(known) if len(known) else 0.0
        return np.clip(limits, settings.hold_m, settings.loosest_hold_m)

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
        enough = known >= self.settings.fewest_neighbours
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
            kept = (off < self.settings.loosest_hold_m).sum(axis=1)
        return self.seen[:, marker] & ((2 * kept >= known) & ((kept > 0) | (known == 0)))


def rigid_neighbours(
    points_ground: Float[np.ndarray, "frames markers 3"],
    skeleton: Skeleton,
    settings: LabelRepairSettings,
) -> RigidNeighbours:
    """Find the distances that most frames agree on, within segments and, where these are few, to the next.

    Args:
        points_ground: one trial's [m], NaN where unseen.
        skeleton: whose markers they are, in this order.
        settings: how much a kept distance scatters.
    """
    one, usual = on_one_segment(skeleton), np.full((len(skeleton.markers),) * 2, np.nan)
    for a, b in np.argwhere(np.triu(on_near_segments(skeleton), 1)):
        distance = np.linalg.norm(points_ground[:, a] - points_ground[:, b], axis=1)
        distance = distance[np.isfinite(distance)]
        if len(distance) < 2 * settings.fewest_frames:
            continue
        middle = np.median(distance)
        scatter = NORMAL * np.median(np.abs(distance - middle))
        most = settings.rigid_m if one[a, b] else settings.rigid_across_m
        if scatter < most and middle < settings.reach_m:
            usual[a, b] = usual[b, a] = middle
    own = (np.isfinite(usual) & one).sum(axis=1)
    enough = own > settings.fewest_neighbours  # as many are left without the one it may be exchanged with
    return RigidNeighbours(points_ground, np.where(enough[:, None] & ~one, np.nan, usual), settings)


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
