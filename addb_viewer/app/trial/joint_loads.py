"""How large the torque is at the joint that each body hangs from, and the largest one of a subject."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.fit import TrialFit
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class JointLoads:
    """Of one trial."""

    of_bodies: Float[np.ndarray, "frames bodies"]  # [N·m] NaN where no joint turns it, or outside the fit
    largest: float  # [N·m] of the subject, on any frame of any trial


def joint_loads(
    skeleton: Skeleton, torques: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "frames bodies"]:
    """Root of the sum of squares over a joint's rotations [N·m]; NaN for the root, which no joint holds.

    Args:
        skeleton: of the torques.
        torques: [N·m or N]
    """
    column = {c.name: k for k, c in enumerate(skeleton.free_coordinates) if c.motion != "translation"}
    sizes = np.full((len(torques), len(skeleton.bodies)), np.nan)
    for body, joint in enumerate(skeleton.joints):
        turning = {axis.coordinate for axis in joint.axes if axis.kind == "rotation"}
        columns = [column[name] for name in turning if name in column]
        if joint.parent >= 0 and columns:
            sizes[:, body] = np.linalg.norm(torques[:, columns], axis=1)
    return sizes


def largest_joint_load(skeleton: Skeleton, trials: Sequence[TrialFit]) -> float:
    """Of all trials [N·m]; 0 where no torque is known."""
    found = [joint_loads(skeleton, t.dynamics.joint_torques) for t in trials if t.dynamics is not None]
    known = [sizes[np.isfinite(sizes)].max(initial=0.0) for sizes in found]
    return float(max(known, default=0.0))
