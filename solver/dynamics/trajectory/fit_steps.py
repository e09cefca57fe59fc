"""A few steps of the trajectory fit from near its end, where its weights or terms are others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import TrajectorySolver, refuse
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class Stepped:
    """Where a few steps of the fit lead."""

    skeleton: Skeleton
    motions: tuple[Motion, ...]
    extra: Float[np.ndarray, " extra"]
    corner: Float[np.ndarray, "shared shared"]  # of φ and x, the trajectories eliminated
    splines: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # coefficients of the motions
    phi: Float[np.ndarray, " parameters"]

    @property
    def extra_variance(self) -> Float[np.ndarray, " extra"]:
        """Of x."""
        variance = np.diag(np.linalg.inv(self.corner))
        return variance[len(variance) - len(self.extra) :]


def stepped(
    skeleton: Skeleton,
    trials: Sequence[TrialData],
    settings: TrajectorySettings,
    count: int,
    *,
    phi: Float[np.ndarray, " parameters"] | None = None,
    extra: ExtraParameters,
) -> Stepped:
    """So many steps of the fit from near its end, where each arrives within the square of what the last left.

    Args:
        skeleton: scaled, with the entered mass.
        trials: as for the fit.
        settings: weights.
        count: of the steps, one or more.
        phi: inertia parameters where they begin; None: the nominal ones.
        extra: of the trials' extra columns.

    Raises:
        FitError: as the fit.
    """
    refuse(trials, extra)
    with threadpool_limits(1):
        solver = TrajectorySolver(skeleton, trials, settings, extra)
        state = solver.begun(phi)
        for _ in range(count):
            system = solver.linearized(state)
            gradient = solver.gradient_of(state, system)
            factor = solver.factorized(state, system)
            state = solver.stepped(state, factor.step(gradient))
            corner = factor.corner
            del system, factor  # before the next ones are built
        return Stepped(
            skeleton=solver.skeleton(state),
            motions=tuple(part.motion(at) for part, at in solver.at(state)),
            extra=state.shared.x,
            corner=corner,
            splines=tuple(state.coefficients),
            phi=state.shared.phi,
        )
