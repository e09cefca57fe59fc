"""The model as readers of B3D take it from the file: which coordinates and joints it has, in which order.

They walk from the root down, children in the order of the model file, and hold locked coordinates as degrees
of freedom that stand still. Coupled coordinates, and joints with no others (the patellae), are not theirs.
"""

from dataclasses import replace

import numpy as np

from solver.kinematics.motion import Motion, ResampledMotion
from solver.skeleton.osim_writer import coordinate_names, joint_order
from solver.skeleton.skeleton import Skeleton


def unlocked(skeleton: Skeleton) -> Skeleton:
    """The skeleton with its locked coordinates among the degrees of freedom."""
    free = tuple(replace(c, locked=False) for c in skeleton.coordinates)
    return replace(skeleton, coordinates=free)


def unlocked_motion(motion: Motion, skeleton: Skeleton) -> Motion:
    """The motion of `unlocked(skeleton)`: locked coordinates stay at their values."""
    free = unlocked(skeleton).free_coordinates

    def widened(values: np.ndarray, of_locked: list[float]) -> np.ndarray:
        return np.column_stack(
            [
                values[:, motion.dofs.index(c.name)] if c.name in motion.dofs else np.full(len(values), still)
                for c, still in zip(free, of_locked, strict=True)
            ]
        )

    moved = replace(motion, dofs=unlocked(skeleton).dofs, q=widened(motion.q, [c.default for c in free]))
    if isinstance(moved, ResampledMotion):
        rest = [0.0] * len(free)
        return replace(moved, qd=widened(moved.qd, rest), qdd=widened(moved.qdd, rest))
    return moved


def joints_in_order(skeleton: Skeleton) -> list[int]:
    """Indices of the joints, from the root down."""
    rank = {joint: place for place, joint in enumerate(joint_order(skeleton))}
    children: dict[int, list[int]] = {}
    for joint in sorted(rank, key=rank.__getitem__):
        children.setdefault(skeleton.joints[joint].parent, []).append(joint)
    order: list[int] = []
    waiting = list(children.get(-1, ()))
    while waiting:
        joint = waiting.pop()
        order.append(joint)
        waiting += children.get(joint, [])[::-1]
    return [joint for joint in order if not _only_coupled(skeleton, joint)]


def dofs_in_order(skeleton: Skeleton) -> tuple[str, ...]:
    """Names of the coordinates that make up `pos`, locked ones included."""
    free = set(unlocked(skeleton).dofs)
    names = (name for i in joints_in_order(skeleton) for name in coordinate_names(skeleton.joints[i]))
    return tuple(dict.fromkeys(name for name in names if name in free))


def _only_coupled(skeleton: Skeleton, joint: int) -> bool:
    coupled = {c.name for c in skeleton.coordinates if c.coupling is not None}
    names = coordinate_names(skeleton.joints[joint])
    return bool(names) and coupled.issuperset(names)
