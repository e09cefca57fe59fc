"""Joint torques and residual wrench of one trial."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.kinematics.motion import Motion

BodyLoad = tuple[str, Float[np.ndarray, "frames 6"]]  # on a body: force [N], moment about ground origin [N·m]


@dataclass(frozen=True)
class TrialStd:
    """How far a trial's values may be off, frame by frame: standard deviations, NaN where none is known.

    Those of angles are about the trial's mean, which the model's landmarks may set off by more; all are of
    what is slower than 20 Hz.
    """

    angle: Float[np.ndarray, "frames dofs"]  # [rad or m]
    speed: Float[np.ndarray, "frames dofs"]  # a second
    acceleration: Float[np.ndarray, "frames dofs"]  # a second squared
    torque: Float[np.ndarray, "frames dofs"]  # [N·m or N]
    power: Float[np.ndarray, "frames dofs"]  # [W]
    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    torque_by_motion: Float[np.ndarray, "frames dofs"] | None = (
        None  # without what a predicted wrench may be off; None: nothing rests on one
    )
    power_by_motion: Float[np.ndarray, "frames dofs"] | None = None  # likewise
    predicted_force_ground: Float[np.ndarray, "frames feet 3"] | None = None  # [N] zero where it was measured


@dataclass(frozen=True)
class MassStd:
    """How far the fitted masses may be off: standard deviations [kg].

    `untold_kg` is what it would be had the recording told nothing of how the mass is shared out.
    """

    body_kg: float
    segments_kg: Float[np.ndarray, " bodies"]
    untold_kg: Float[np.ndarray, " bodies"]


@dataclass(frozen=True)
class Dynamics:
    """Inverse dynamics of one trial.

    The residual is the external wrench that the motion demands less the measured one: force [N], and moment
    [N·m] about the root joint's centre, both in the ground frame. Zero means F = ma holds.
    """

    joint_torques: Float[np.ndarray, "frames dofs"]  # [N·m or N], root dofs included
    residual_root: Float[np.ndarray, "frames 6"]
    residual_raw_root: Float[np.ndarray, "frames 6"]  # likewise against unfiltered forces
    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    root_ground: Float[np.ndarray, "frames 3"]  # [m] the root joint's centre
    used: Bool[np.ndarray, " frames"]  # frames that the figures count
    motion: Motion  # that all of this was computed on: low-passed as the forces are
    wrench_is_predicted: Bool[np.ndarray, "frames feet"] | None = (
        None  # feet whose wrench in the torques was not measured but predicted from the motion; None: none
    )
    wrench_predicted_ground: Float[np.ndarray, "frames feet 6"] | None = (
        None  # that wrench [N, N·m about the ground origin], zero where one was measured; None: none
    )
