"""Where each foot presses, by its markers alone: those that are down bear more than those that are up.

A foot strikes with the toes up and leaves with the heel up, so that the middle of what is down goes from heel
to toe as the pressure does. Low markers that keep their distance are one foot. So do two feet that both stand
still: these are told apart by the sides in their labels, or not at all.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from solver.capture.capture import Markers
from solver.diagnosis.direct_checks.settings import DIRECT_CHECKES, DirectCheckSettings
from solver.markers.label_parts import sides

FEWEST_MARKERS = 2  # one marker has no heel and toe
MOST_MARKERS = 24  # of somebody who lies down, all would be low


@dataclass(frozen=True)
class PressingFoot:
    """One foot over time."""

    middle: Float[np.ndarray, "frames 2"]  # [m] x and z of what is down; NaN where unseen
    lift: Float[np.ndarray, " frames"]  # [m] of its lowest marker above its own lowest; NaN where unseen


def pressing_feet(markers: Markers, settings: DirectCheckSettings = DIRECT_CHECKES) -> Sequence[PressingFoot]:
    """Both feet, or the one that is seen; none where no foot has two markers."""
    height = markers.positions_ground[:, :, 1]
    seen = np.flatnonzero(np.isfinite(height).any(axis=0))
    if not len(seen):
        return ()
    lowest = np.nanpercentile(height[:, seen], 2, axis=0)
    low = seen[lowest < lowest.min() + settings.foot_height_m]
    low = low[np.argsort(np.nanpercentile(height[:, low], 2, axis=0))][:MOST_MARKERS]
    still = _that_keep_their_distance(markers.positions_ground[:, low], settings)
    side_of = sides(tuple(markers.names))
    groups = [g for kept in still for g in _one_foot_each(markers, low[kept], side_of, settings)]
    groups = [g for g in sorted(groups, key=len, reverse=True) if len(g) >= FEWEST_MARKERS]
    return [_foot(markers.positions_ground[:, g], settings) for g in groups[:2]]


def _one_foot_each(
    markers: Markers,
    group: Int[np.ndarray, " markers"],
    side_of: Mapping[str, str],
    settings: DirectCheckSettings,
) -> list[Int[np.ndarray, " markers"]]:
    """The same, or those of each side where both are in it; none where it is longer than a foot."""
    of_side = [group[[side_of.get(markers.names[k]) == side for k in group]] for side in ("r", "l")]
    if all(map(len, of_side)):
        return of_side
    flat = markers.positions_ground[:, group][:, :, [0, 2]]
    apart = [np.linalg.norm(flat[:, i] - flat[:, k], axis=1) for i in range(len(group)) for k in range(i)]
    lengths = [np.median(a[np.isfinite(a)]) for a in apart if np.isfinite(a).any()]
    return [group] if max(lengths, default=0.0) < settings.foot_length_m else []


def _that_keep_their_distance(
    places: Float[np.ndarray, "frames markers 3"], settings: DirectCheckSettings
) -> list[list[int]]:
    count = places.shape[1]
    group = list(range(count))
    for i in range(count):
        for j in range(i):
            apart = np.linalg.norm(places[:, i] - places[:, j], axis=1)
            apart = apart[np.isfinite(apart)]
            if len(apart) and apart.max() < settings.foot_length_m and apart.std() < settings.foot_rigid_m:
                old, new = group[i], group[j]
                group = [new if g == old else g for g in group]
    return [[k for k in range(count) if group[k] == g] for g in sorted(set(group))]


def _foot(places: Float[np.ndarray, "frames markers 3"], settings: DirectCheckSettings) -> PressingFoot:
    above = places[:, :, 1] - np.nanpercentile(places[:, :, 1], 2, axis=0)
    bears = np.exp(-np.clip(np.nan_to_num(above, nan=1.0), -settings.pressing_m, 1.0) / settings.pressing_m)
    bears = np.where(np.isfinite(above), bears, 0.0)
    total = bears.sum(axis=1)
    flat = np.nan_to_num(places[:, :, [0, 2]])
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = (bears[:, :, None] * flat).sum(axis=1) / total[:, None]
    middle[total <= 0] = np.nan
    lift = np.min(np.where(np.isfinite(above), above, np.inf), axis=1)
    return PressingFoot(middle, np.where(np.isfinite(lift), lift, np.nan))
