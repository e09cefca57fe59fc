"""Makes an answer whole: accelerations that obey the forces, torques by the equation of motion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from addb_viewer.benchmark.differences import central_differences
from addb_viewer.benchmark.errors import BenchmarkError
from addb_viewer.benchmark.task import Predicted, Seen
from solver.common.filters import low_pass
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel

CUTOFF_HZ = 30.0  # the paper's supplement, of the differenced motion; order 3


@dataclass(frozen=True)
class WholeAnswer:
    """Everything that is scored of an answer; arrays as in `Predicted`."""

    force: Float[np.ndarray, "frames feet 3"]  # [N]
    moment: Float[np.ndarray, "frames feet 3"]  # about the foot bodies' origins [N·m]
    foot_ground: Float[np.ndarray, "frames feet 3"]  # those origins [m]
    acceleration: Float[np.ndarray, "frames dofs"]
    com_acceleration: Float[np.ndarray, "frames 3"]  # of that acceleration, with gravity not taken off [m/s²]
    torque: Float[np.ndarray, "frames dofs"]
    remainder: Float[np.ndarray, "frames dofs"]  # of τ = M q̈ + C + g − Jᵀ f that the answer leaves
    root_dofs: tuple[int, ...]
    force_sd: Float[np.ndarray, "frames feet 3"] | None


def completed(seen: Seen, predicted: Predicted) -> WholeAnswer:
    """What the predictor did not say is added.

    Args:
        seen: what it was shown.
        predicted: what it said.

    Raises:
        BenchmarkError: an array has another shape, or values that are no numbers.
    """
    _check(seen, predicted)
    model, root = RigidBodyModel(seen.skeleton), root_joint(seen.skeleton)
    q, velocity, acceleration = motion_of(seen, predicted)
    com = model.centre_of_mass_acceleration(q, velocity, acceleration)
    if predicted.acceleration is None:
        required = predicted.force.sum(axis=1) / seen.mass_kg + seen.skeleton.gravity
        acceleration = acceleration.copy()
        acceleration[:, root.translation_dofs] += (required - com) @ np.linalg.inv(_ground_axes(root)).T
        com = required
    right_left = list(seen.feet)
    feet = body_poses(seen.skeleton, seen.q)[1][:, right_left]
    wrenches = np.concatenate(
        [predicted.force, predicted.moment + np.cross(feet, predicted.force)], axis=2
    )  # about the ground origin
    by_equation = model.inverse_dynamics(q, velocity, acceleration, wrenches, right_left)
    torque = by_equation if predicted.torque is None else predicted.torque
    return WholeAnswer(
        force=predicted.force,
        moment=predicted.moment,
        foot_ground=feet,
        acceleration=acceleration,
        com_acceleration=com,
        torque=torque,
        remainder=torque - by_equation,
        root_dofs=tuple(int(dof) for dof in root.dofs),
        force_sd=predicted.force_sd,
    )


def motion_of(
    seen: Seen, predicted: Predicted
) -> tuple[
    Float[np.ndarray, "frames dofs"], Float[np.ndarray, "frames dofs"], Float[np.ndarray, "frames dofs"]
]:
    """Coordinates and derivatives: the predictor's where it gives them, else of the filtered motion.

    Args:
        seen: what it was shown.
        predicted: what it said.
    """
    q = seen.q if predicted.q is None else predicted.q
    velocity, acceleration = central_differences(low_pass(q, seen.rate, CUTOFF_HZ), seen.rate)
    return (
        q,
        velocity if predicted.velocity is None else predicted.velocity,
        acceleration if predicted.acceleration is None else predicted.acceleration,
    )


def _ground_axes(root: RootJoint) -> Float[np.ndarray, "3 3"]:
    """Columns: where the root goes, in the ground frame, as each of its translations grows by one."""
    columns = []
    for axis in root.translations:
        at = axis.function(np.array([0.0, 1.0]))[0]
        columns.append(root.joint.R_parent_frame @ axis.axis * (at[1] - at[0]))
    return np.column_stack(columns)


def _check(seen: Seen, predicted: Predicted) -> None:
    feet, dofs = (seen.frames, 2, 3), seen.q.shape
    wanted = {"force": feet, "moment": feet, "force_sd": feet} | dict.fromkeys(
        ("acceleration", "velocity", "q", "torque"), dofs
    )
    for name, shape in wanted.items():
        value = getattr(predicted, name)
        if value is None:
            continue
        if np.shape(value) != shape:
            raise BenchmarkError(f"the predictor's {name} has shape {np.shape(value)}; it must be {shape}")
        if not np.isfinite(value).all():
            frame = int(np.flatnonzero(~np.isfinite(value).reshape(len(value), -1).all(axis=1))[0])
            raise BenchmarkError(f"the predictor's {name} is no number on frame {frame} of the stretch")
