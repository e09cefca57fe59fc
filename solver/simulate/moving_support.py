"""A floor that accelerates, seen by cameras that move with it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.simulate.spline_motion import SplineMotion
from solver.skeleton.forward import cross
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class MovingSupport:
    """The acceleration of the support as a sum of sines along one direction.

    Motions are relative to the support, so that each particle of mass m feels −m a besides its weight.
    """

    skeleton: Skeleton
    direction_ground: Float[np.ndarray, "3"]
    waves: tuple[tuple[float, float, float], ...]  # amplitude [m/s²], frequency [Hz], phase [rad]

    def acceleration(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 3"]:
        """Of the support [m/s²]."""
        time_history = np.zeros(len(times))
        for amplitude, frequency, phase in self.waves:
            time_history += amplitude * np.sin(2 * np.pi * frequency * times + phase)
        return time_history[:, None] * self.direction_ground

    def __call__(
        self, motion: SplineMotion, times: Float[np.ndarray, " times"]
    ) -> Float[np.ndarray, "times 6"]:
        """Force [N] and moment about the ground origin [N·m]."""
        force = -self.skeleton.mass * self.acceleration(times)
        com = RigidBodyModel(self.skeleton).centre_of_mass(motion.derivative(times, 0))
        return np.concatenate([force, cross(com, force)], axis=1)
