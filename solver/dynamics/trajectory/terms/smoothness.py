"""Smoothness: the jerk that a trajectory has, against the level of each dof's own."""

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.trial_point import TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion


class Smoothness:
    """κ Σ_j ∫ (d³q_j/dt³)² dt / ȷ_j², with ȷ_j the dof's jerk level in the marker fit."""

    def __init__(self, jerk: Float[np.ndarray, " dofs"], settings: TrajectorySettings) -> None:
        """Of a trial.

        Args:
            jerk: `jerk_level` of the marker fit [rad/s³ or m/s³].
            settings: κ.
        """
        self.weight = settings.smoothness / jerk**2

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        c = at.coefficients[:, : len(self.weight)]
        return float(self.weight @ (at.basis.jerk(c) ** 2).sum(axis=(0, 2)))

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        columns = slice(len(self.weight))
        c = at.coefficients[:, columns]
        gradient.coefficients[:, columns] += self.weight * at.basis.jerk_product(c)

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """Quadratic, so the band's share is the same everywhere."""
        system.band.add_jerk(self.weight)
        self.add_gradient(at, system.gradient)
        system.cost += self.cost(at)


def jerk_level(motion: Motion, settings: TrajectorySettings) -> Float[np.ndarray, " dofs"]:
    """RMS third derivative of each dof in the marker fit below its noise [rad/s³ or m/s³].

    Running jerks ten times as much as walking; a smoothness that fits one would bend the other.
    """
    jerk = motion.low_passed(settings.jerk_cutoff_Hz).derivative(3)
    inner = jerk[len(jerk) // 10 : len(jerk) - len(jerk) // 10]
    own = np.sqrt((inner**2).mean(axis=0))
    return np.maximum(own, settings.least_jerk_share * np.sqrt((own**2).mean()))
