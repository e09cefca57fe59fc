"""What every way gives back and every truth is: coordinates with their derivatives, and torques."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.kinematics.motion import Motion
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class TimeHistory:
    """One motion on the markers' frames, and what the joints bore."""

    dofs: tuple[str, ...]
    rate: float  # [Hz]
    angle: Float[np.ndarray, "frames dofs"]  # [rad or m]
    speed: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]
    torque: Float[np.ndarray, "frames dofs"] | None = None  # [N·m or N]; None: no forces

    def with_torque(self, torque: Float[np.ndarray, "frames dofs"] | None) -> "TimeHistory":
        """The same motion with those torques."""
        return replace(self, torque=torque)


def time_history_of(motion: Motion, torque: Float[np.ndarray, "frames dofs"] | None = None) -> TimeHistory:
    """A motion with its derivatives."""
    return TimeHistory(motion.dofs, motion.rate, motion.q, motion.velocity, motion.acceleration, torque)


def torques_of(
    skeleton: Skeleton,
    motion: Motion,
    wrench_ground: Float[np.ndarray, "frames feet 6"],
    foot_bodies: Sequence[str],
) -> Float[np.ndarray, "frames dofs"]:
    """Inverse dynamics of a motion under the feet's wrenches [N, N·m about the ground origin]."""
    feet = [skeleton.body_index(name) for name in foot_bodies]
    return RigidBodyModel(skeleton).inverse_dynamics(
        motion.q, motion.velocity, motion.acceleration, wrench_ground, feet
    )
