"""Pull to the marker fit: dofs that markers barely see, or not at all, would absorb the residual."""

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.trial_point import TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import untold_dofs
from solver.skeleton.skeleton import Skeleton


def pull_precision(
    skeleton: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    settings: TrajectorySettings,
) -> Float[np.ndarray, " dofs"]:
    """Of each frame's pull to the marker fit [1/rad²]; none for the root.

    Args:
        skeleton: its markers are those observed.
        observed_ground: NaN where unseen [m].
        settings: how far dofs may leave the marker fit that markers see, and those that none sees.
    """
    untold = untold_dofs(skeleton, observed_ground)
    std = np.where(untold, settings.untold_std_rad, settings.pose_std_rad)
    return np.where(root_dofs(skeleton), 0.0, std**-2)


class PosePull:
    """Σ_t Σ_j (q_tj − q⁰_tj)²/σ_j², over all dofs but the root's."""

    def __init__(self, start: Motion, precision: Float[np.ndarray, " dofs"]) -> None:
        """Of a trial.

        Args:
            start: the marker fit.
            precision: `pull_precision`.
        """
        self.start_q, self.precision = start.q, precision

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        return at.frame_weight * float((self.precision * (at.q - self.start_q) ** 2).sum())

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        gradient.add_frames(at.basis, at.frame_weight * self.precision * (at.q - self.start_q))

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """Quadratic, so the band's share is the same everywhere."""
        system.band.add_values(at.frame_weight * self.precision)
        self.add_gradient(at, system.gradient)
        system.cost += self.cost(at)
