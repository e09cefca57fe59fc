"""Gains on what the markers' own motion demands: a body that is heavier, late or damped, axis by axis.

The wrench is g₀ W + g₁ Ẇ + g₂ Ẅ, with W required by the marker fit below a cut-off, in the heading frame. A
delay by τ is g₁ = −τ. No steps are needed, so it holds for squats and stairs too.
"""

import numpy as np
from jaxtyping import Float

from solver.common.filters import ORDER
from solver.common.frames_at_once import by_frames
from solver.common.notes import Kind, Note, noted
from solver.dynamics.force_prediction.columns import Columns
from solver.dynamics.force_prediction.heading_frame import HeadingFrame
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.dynamics.material_acceleration import material_accelerations
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

KIND = "gains"
FORCES = "forward force", "vertical force", "lateral force"


def required_ground(skeleton: Skeleton, motion: Motion) -> Float[np.ndarray, "frames 6"]:
    """The external wrench that a motion needs: force [N], moment about the ground origin [N·m].

    Args:
        skeleton: of the motion, with its masses.
        motion: of one trial.
    """
    kinematics = ForwardKinematics(skeleton)
    inertias = np.stack([pseudo_inertia(body) for body in skeleton.bodies])

    def required(
        q: Float[np.ndarray, "some dofs"],
        v: Float[np.ndarray, "some dofs"],
        a: Float[np.ndarray, "some dofs"],
    ) -> Float[np.ndarray, "some 6"]:
        A, T = material_accelerations(kinematics, kinematics.poses(q), q, v, a)
        return required_wrench(A, T, inertias).sum(axis=1)

    moved = motion.without_derivatives()
    return by_frames(required, moved.q, moved.velocity, moved.acceleration)


def smooth_demand(
    skeleton: Skeleton, motion: Motion, frame: HeadingFrame, settings: PredictionSettings
) -> Float[np.ndarray, "frames 6"]:
    """W, in the heading frame about its origin [N, N·m].

    Args:
        skeleton: with the person's mass.
        motion: of the markers alone.
        frame: of that motion.
        settings: the cut-off.
    """
    smooth = motion.low_passed(settings.demand_cutoff_Hz, ORDER)
    return frame.from_ground(required_ground(skeleton, smooth))


def gain_columns(
    demand: Float[np.ndarray, "frames 6"], rate: float, frame: HeadingFrame, settings: PredictionSettings
) -> Columns:
    """Eighteen: gain, lag and damping of each axis, one axis after the other.

    Args:
        demand: W.
        rate: [Hz].
        frame: that it is told in.
        settings: scatter of the gains.
    """
    first = np.gradient(demand, 1 / rate, axis=0)
    second = np.gradient(first, 1 / rate, axis=0)
    of_axes = np.stack([demand, first, second], axis=2)  # frames, axes, three
    columns = (np.eye(6)[None, :, :, None] * of_axes[:, None]).reshape(len(demand), 6, 18)
    std = np.tile([settings.gain_std, settings.lag_std_s, settings.damping_std_s2], 6)
    return Columns(KIND, frame.to_ground(columns), std)


def gain_notes(
    x: Float[np.ndarray, "18"], std: Float[np.ndarray, "18"], settings: PredictionSettings
) -> tuple[Note, ...]:
    """What the gains may point to; only of what is beyond its own uncertainty.

    Args:
        x: learnt.
        std: of x.
        settings: from which size on one is told.
    """
    parts = []
    for axis, (gain, lag, _), (gain_std, lag_std, _) in zip(
        FORCES, x.reshape(6, 3)[:3], std.reshape(6, 3)[:3], strict=True
    ):
        if abs(gain) > max(settings.notable_gain, 2 * gain_std):
            parts.append(f"{axis} {-100 * gain:+.0f} ± {200 * gain_std:.0f} %")
        if abs(lag) > max(settings.notable_lag_s, 2 * lag_std):
            late = "late" if lag > 0 else "early"
            parts.append(f"{axis} {1000 * abs(lag):.0f} ± {2000 * lag_std:.0f} ms {late}")
    if not parts:
        return ()
    return noted(
        Kind.FORCES_AGAINST_BODY,
        f"compared with the forces that the markers' motion requires, plates read {', '.join(parts)}: a "
        "plate's gain, a time shift, or wrong masses and soft tissue in the model?",
    )
