"""One trial's cost in the trajectory fit: the sum of its terms."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.spline_band import nearest_spline
from solver.dynamics.trajectory.spline_basis import SplineBasis, spline_basis
from solver.dynamics.trajectory.terms.held_ends import HeldEnds
from solver.dynamics.trajectory.terms.markers import Markers
from solver.dynamics.trajectory.terms.pose_pull import PosePull
from solver.dynamics.trajectory.terms.root_residual import RootResidual
from solver.dynamics.trajectory.terms.shared_parameters import SharedParameters
from solver.dynamics.trajectory.terms.smoothness import Smoothness
from solver.dynamics.trajectory.terms.term import Term
from solver.dynamics.trajectory.terms.trial_point import TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.dynamics.trajectory.trial_levels import trial_levels
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton


def knot_spacing(motion: Motion, settings: TrajectorySettings) -> int:
    """Of a trial's splines [frames]."""
    return max(1, round(settings.knot_spacing_s * motion.rate))


def basis_for(motion: Motion, settings: TrajectorySettings) -> SplineBasis:
    """Of a trial's splines."""
    return spline_basis(motion.frames, motion.rate, knot_spacing(motion, settings))


class TrialCost:
    """What one trial adds to the cost of the trajectory fit, by its spline and the shared parameters."""

    def __init__(
        self, skeleton: Skeleton, data: TrialData, settings: TrajectorySettings, extra: int = 0
    ) -> None:
        motion = data.start
        self.data, self.kinematics = data, ForwardKinematics(skeleton)
        self.basis: SplineBasis = basis_for(motion, settings)
        self.residual = RootResidual(data, settings, extra)
        levels = data.levels or trial_levels(self.kinematics, data.observed_ground, motion, settings)
        self.without_forces: tuple[Term, ...] = (
            Markers(self.kinematics, data.observed_ground, motion, settings, levels.marker_errors),
            PosePull(motion, levels.pull),
            Smoothness(levels.jerk, settings),
        )
        before, after = data.held_ends
        if before or after:
            assert data.spline is not None
            self.without_forces += (HeldEnds(data.spline, before=before, after=after),)

    @property
    def terms(self) -> tuple[Term, ...]:
        """All."""
        return (*self.without_forces, self.residual)

    def start(self, shared: SharedParameters) -> Float[np.ndarray, "coefficients columns"]:
        """The spline that the search begins with: an earlier fit's, or the one nearest to a motion.

        Args:
            shared: parameters that it begins with; where there are two places to begin, they decide.
        """
        data = self.data
        begun = data.spline
        if begun is None:
            begun = nearest_spline(self.basis, (data.initial or data.start).q)
        if data.other_start is None:
            return begun
        other = nearest_spline(self.basis, data.other_start.q)
        first, second = (self.cost(self.point(spline, shared)) for spline in (begun, other))
        return other if second < first else begun

    def point(
        self, coefficients: Float[np.ndarray, "coefficients columns"], shared: SharedParameters
    ) -> TrialPoint:
        """Where its terms are asked; it holds the trial's poses, so it should not outlive the question."""
        return TrialPoint(self.basis, self.kinematics, coefficients, shared)

    def motion(self, at: TrialPoint) -> Motion:
        """The trajectory at the frames."""
        return replace(self.data.start, q=at.q)

    def cost(self, at: TrialPoint) -> float:
        """All terms but the priors of the shared parameters."""
        return sum(term.cost(at) for term in self.terms)

    def gradient(self, at: TrialPoint) -> TrialGradient:
        """Of half the cost."""
        gradient = TrialGradient.zero(at.coefficients.shape, at.shared.count)
        for term in self.terms:
            term.add_gradient(at, gradient)
        return gradient

    def linearized(self, at: TrialPoint) -> TrialSystem:
        """Gauss-Newton's system."""
        system = TrialSystem.zero(self.basis, at.coefficients.shape[1], at.shared.count)
        for term in self.terms:
            term.add_linearized(at, system)
        return system
