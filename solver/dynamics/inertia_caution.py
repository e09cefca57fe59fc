"""How far forces are to be believed about inertias: as far as the markers' motion explains them.

The trajectory fit takes the errors of frames as independent, of 16 N and 8 N·m. What a model, a clock or a
plate gets wrong lasts for a sixth of a second or a whole trial, and may be many times as large. Taken at its
word, such an error makes shanks twice what they are.
"""

from collections.abc import Sequence

import numpy as np

from solver.dynamics.foretelling.demand_gains import demanded_ground
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.terms.trial_point import REFERENCE_RATE_HZ
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trial_data import TrialData
from solver.filters import low_pass
from solver.frames_at_once import by_frames
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton


def inertia_caution(skeleton: Skeleton, trials: Sequence[TrialData], settings: TrajectorySettings) -> float:
    """By how much the fit overrates what its frames say of inertias; at least 1.

    Below a cut-off f, a second holds 2f independent errors, where the fit counts a hundred of a fixed size.
    Theirs is what the marker fit's motion leaves unexplained there, with the inertias of the tables.

    Args:
        skeleton: scaled, with these inertias.
        trials: their marker fits and forces.
        settings: the fit's deviations of the residual, and the cut-off.
    """
    squares, frames = 0.0, 0.0
    for trial in trials:
        weight = int(trial.counts.sum()) / trial.start.rate
        if weight:
            squares += weight * _unexplained(skeleton, trial, settings)
            frames += weight
    size = squares / frames if frames else 0.0
    return max(1.0, size * REFERENCE_RATE_HZ / (2 * settings.inertia_cutoff_Hz))


def _unexplained(skeleton: Skeleton, trial: TrialData, settings: TrajectorySettings) -> float:
    """Mean square of the low-passed residual about the root joint's centre, over the fit's own deviations."""
    motion = trial.start
    missing = demanded_ground(skeleton, motion) - trial.wrench_ground
    if trial.extra_wrench_ground is not None:
        missing = missing - trial.extra_wrench_ground
    root = root_joint(skeleton)
    kinematics = ForwardKinematics(skeleton)
    centre = by_frames(lambda q: root_centre(root, kinematics.poses(q)), motion.q)
    missing = about_point(missing, centre)
    missing[~trial.counts] = 0.0
    slow = low_pass(missing, motion.rate, settings.inertia_cutoff_Hz)[trial.counts]
    std = np.repeat([settings.residual_force_std_N, settings.residual_moment_std_Nm], 3)
    return float(np.mean((slow / std) ** 2))
