"""How far a label moves at once, beyond its neighbours: the one that does has changed trajectories.

Distances alone cannot tell the front pair of a pelvis exchanged from the rear pair: both give its mirror
image.
"""

from collections.abc import Sequence

import numpy as np

from solver.kinematics.label_faults.rigid_neighbours import RigidNeighbours
from solver.kinematics.label_faults.stretches import Stretch


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
        near = last - first <= 1 + rigid.settings.step_frames + rigid.settings.longest_gap_s * rate
        found.append((first, last) if near else None)
    return found
