"""What of a trial's marker fit sets the trajectory fit's weights: the same in every part of the trial."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.marker_error_levels import MarkerErrorLevels, marker_error_levels
from solver.dynamics.trajectory.terms.pose_pull import pull_precision
from solver.dynamics.trajectory.terms.smoothness import jerk_level
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics


@dataclass(frozen=True)
class TrialLevels:
    """Of a whole trial."""

    marker_errors: MarkerErrorLevels
    pull: Float[np.ndarray, " dofs"]  # precision of the pull to the marker fit [1/rad²]
    jerk: Float[np.ndarray, " dofs"]  # [rad/s³ or m/s³]


def trial_levels(
    kinematics: ForwardKinematics,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    start: Motion,
    settings: TrajectorySettings,
) -> TrialLevels:
    """Levels of one trial.

    Args:
        kinematics: of the skeleton whose markers were observed.
        observed_ground: NaN where unseen [m].
        start: the marker fit.
        settings: least levels, and how far the motion may leave the marker fit.
    """
    return TrialLevels(
        marker_error_levels(kinematics, observed_ground, start, settings),
        pull_precision(kinematics.skeleton, observed_ground, settings),
        jerk_level(start, settings),
    )
