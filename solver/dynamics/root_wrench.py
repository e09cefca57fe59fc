"""From generalized forces of the root joint to a wrench in the ground frame; the root moved."""

import numpy as np
from jaxtyping import Float

from solver.common.frames_at_once import by_frames
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.skeleton.chain import Chain
from solver.skeleton.forward import ForwardKinematics, Poses, cross
from solver.skeleton.skeleton import Skeleton

NEARLY_SINGULAR = 1e-9  # of the largest singular value; below it the root's angles describe no rotation


def root_wrench(
    root: RootJoint, chain: Chain, poses: Poses, torques: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "frames 6"]:
    """The wrench on the root body that its joint's generalized forces amount to.

    The joint's velocities make the twist S q̇ of the root body, and equal power means τ = Sᵀ w. As everything
    hangs on the root, w is the external wrench that the motion demands beyond what inverse dynamics got.
    The τ of Euler angles are no Cartesian moment: their axes are neither orthogonal nor fixed.

    Args:
        root: the free root joint.
        chain: of the same skeleton.
        poses: at the frames of `torques`.
        torques: generalized forces of all dofs [N·m or N].

    Returns:
        Force [N] and moment about the ground origin [N·m], ground frame.
    """
    columns = poses.twists()[:, chain.body == root.body]
    driven_by = chain.dof[chain.body == root.body][:, None] == root.dofs
    twist = np.einsum("tpk,pd->tdk", columns, driven_by.astype(float))
    twist = np.nan_to_num(twist)  # of frames without a pose; their torques stay NaN
    moment_and_force = np.linalg.pinv(twist, rcond=NEARLY_SINGULAR) @ torques[:, root.dofs, None]
    return np.concatenate([moment_and_force[:, 3:, 0], moment_and_force[:, :3, 0]], axis=1)


def root_centre(root: RootJoint, poses: Poses) -> Float[np.ndarray, "frames 3"]:
    """The root joint's centre, fixed to the root body, in the ground frame [m]."""
    R_ground_root = poses.R_ground_body[:, root.body]
    return poses.p_ground_body[:, root.body] + R_ground_root @ root.joint.p_child_frame


def about_point(
    wrench_ground: Float[np.ndarray, "frames 6"], point_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 6"]:
    """The same wrench with its moment about another point than the ground origin [N, N·m]."""
    force, moment = wrench_ground[:, :3], wrench_ground[:, 3:]
    return np.concatenate([force, moment - cross(point_ground, force)], axis=1)


def centre_of_mass(skeleton: Skeleton, poses: Poses) -> Float[np.ndarray, "frames 3"]:
    """Centre of mass of the whole body in the ground frame [m]."""
    mass = np.array([body.mass for body in skeleton.bodies])
    offset = np.array([body.com_body for body in skeleton.bodies])
    com_bodies = poses.p_ground_body + (poses.R_ground_body @ offset[None, :, :, None])[..., 0]
    return np.einsum("b,tbi->ti", mass / mass.sum(), com_bodies)


def centre_of_mass_of(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "frames 3"]:
    """Likewise, at generalized coordinates in the order of `skeleton.dofs` [rad or m]."""
    kinematics = ForwardKinematics(skeleton)
    return by_frames(lambda some: centre_of_mass(skeleton, kinematics.poses(some)), q)


def with_com_at(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"], com_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames dofs"]:
    """The same postures with the root moved until the centre of mass is there; no angle changes.

    Args:
        skeleton: scaled.
        q: generalized coordinates [rad or m].
        com_ground: where the centre of mass is to be [m].

    Returns:
        Generalized coordinates; only the root's three translations differ.

    Raises:
        ModelError: the skeleton's root is not free to move in all six ways.
    """
    root = root_joint(skeleton)
    shift_ground = com_ground - centre_of_mass_of(skeleton, q)
    shift_parent = shift_ground @ root.joint.R_parent_frame
    axes = np.array([a.axis / np.linalg.norm(a.axis) for a in root.translations])
    metres_per_unit = np.array([np.diff(a.function(np.array([0.0, 1.0]))[0])[0] for a in root.translations])
    moved = q.copy()
    moved[:, root.translation_dofs] += np.linalg.solve(axes.T, shift_parent.T).T / metres_per_unit
    return moved
