"""A motion at other times than those that it was recorded at."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from solver.common.errors import FitError
from solver.kinematics.motion import Motion


def _none() -> Float[np.ndarray, "0 0"]:
    return np.zeros((0, 0))


@dataclass(frozen=True)
class ResampledMotion(Motion):
    """Samples of a spline: velocities and accelerations are that spline's, not those of one through q."""

    qd: Float[np.ndarray, "frames dofs"] = field(default_factory=_none)  # [rad/s or m/s]
    qdd: Float[np.ndarray, "frames dofs"] = field(default_factory=_none)  # [rad/s² or m/s²]

    @property
    def velocity(self) -> Float[np.ndarray, "frames dofs"]:
        """First derivative [rad/s or m/s]."""
        return self.qd

    @property
    def acceleration(self) -> Float[np.ndarray, "frames dofs"]:
        """Second derivative [rad/s² or m/s²]."""
        return self.qdd

    def low_passed(self, cutoff_Hz: float, order: int = 3) -> Motion:
        """Refused: a filter comes before other times do.

        Raises:
            FitError: always.
        """
        raise FitError(f"filter at {cutoff_Hz:g} Hz before the motion is resampled, order {order}.")


def resampled(motion: Motion, rate: float, frames: int) -> ResampledMotion:
    """The spline through a motion, and its derivatives, at equally spaced times from its first frame on.

    Args:
        motion: as recorded.
        rate: of the new times [Hz].
        frames: how many; the last one lies within the motion.
    """
    seconds = np.arange(frames) / rate
    q, qd, qdd = (motion.at(seconds, order) for order in range(3))
    return ResampledMotion(motion.dofs, q, rate, motion.start_time, qd=qd, qdd=qdd)
