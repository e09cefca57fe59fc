"""What of a fitted trial can be drawn as curves, on the clock of its fit."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.replay import JointReplay
from addb_viewer.trial_view.replay_of_fit import joint_replay
from solver.fitting.fit_result import TrialFit
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class TrialCurves:
    """Joints of a trial over time."""

    name: str
    rate: float  # [Hz]
    times: Float[np.ndarray, " frames"]  # [s] on the recording's clock
    joints: JointReplay
    counts: Bool[np.ndarray, " frames"]  # frames whose forces all count


def trial_curves(trial: TrialFit, skeleton: Skeleton) -> TrialCurves:
    """Of a fitted trial.

    Args:
        trial: fitted.
        skeleton: of the fit.
    """
    motion = trial.motion if trial.dynamics is None else trial.dynamics.motion
    used = np.zeros(motion.frames, dtype=bool) if trial.dynamics is None else trial.dynamics.used
    joints = joint_replay(trial, skeleton, motion.times)
    return TrialCurves(trial.capture.name, motion.rate, motion.times, joints, used)
