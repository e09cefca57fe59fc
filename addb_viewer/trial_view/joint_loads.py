"""How large the torque is at the joint that each body hangs from, and from where on it counts as large."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.fitting.fit_result import TrialFit
from solver.skeleton.skeleton import Skeleton

RARE = 0.02  # of the frames: what only they exceed has the last colour


@dataclass(frozen=True)
class JointLoads:
    """Of one trial."""

    of_bodies: Float[np.ndarray, "frames bodies"]  # [N·m] NaN where no joint turns it, or outside the fit
    large: float  # [N·m] of the subject: what the joint with most exceeds on one frame in fifty


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


def large_joint_load(skeleton: Skeleton, trials: Sequence[TrialFit]) -> float:
    """What the joint that carries most exceeds on one frame in fifty [N·m]; 0 where no torque is known.

    A spike, and frames whose forces do not count, whose torques are not to be believed, set no scale.
    """
    most: list[np.ndarray] = []
    for trial in trials:
        if trial.dynamics is not None:
            used = trial.dynamics.used if trial.dynamics.used.any() else slice(None)
            loads = joint_loads(skeleton, trial.dynamics.joint_torques)[used]
            most.append(np.nan_to_num(loads).max(axis=1, initial=0.0))
    return float(np.quantile(np.concatenate(most), 1 - RARE)) if most else 0.0
