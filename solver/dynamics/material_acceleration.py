"""How every material point of every body accelerates, from the axes' twists alone."""

import numpy as np
from jaxtyping import Float

from solver.common.frames_at_once import by_frames
from solver.dynamics.inertia_parameters import pseudo_inertia, required_wrench
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics, Poses, cross
from solver.skeleton.rotations import skew
from solver.skeleton.skeleton import Skeleton


def material_accelerations(
    kinematics: ForwardKinematics,
    poses: Poses,
    q: Float[np.ndarray, "frames dofs"],
    v: Float[np.ndarray, "frames dofs"],
    a: Float[np.ndarray, "frames dofs"],
) -> tuple[Float[np.ndarray, "frames bodies 3 4"], Float[np.ndarray, "frames bodies 4 4"]]:
    """Acceleration less gravity of material points, and the poses as homogeneous matrices.

    With a body's twist (ω, v₀) and its rate (α, a₀) about the ground origin, a point at x accelerates by
    α × x + a₀ + ω × (v₀ + ω × x).

    Args:
        kinematics: of the skeleton.
        poses: at q.
        q: generalized coordinates [rad or m].
        v: their velocities.
        a: their accelerations.

    Returns:
        A [m/s²] with `ẍ − g = A [x_body; 1]`, and T_ground_body.
    """
    chain, skeleton = kinematics.chain, kinematics.skeleton
    frames, bodies = len(q), len(skeleton.bodies)
    _, slope, curvature = chain.couple(q)
    dp = slope * v[:, chain.dof]
    ddp = slope * a[:, chain.dof] + curvature * v[:, chain.dof] ** 2
    axis = np.concatenate([poses.angular_ground, poses.linear_ground], axis=2)
    twist, rate = np.zeros((bodies, frames, 6)), np.zeros((bodies, frames, 6))
    for body, joint in enumerate(skeleton.joints):
        if joint.parent >= 0:
            twist[body], rate[body] = twist[joint.parent], rate[joint.parent]
        for k in np.flatnonzero(chain.body == body):
            moving = axis[:, k] * dp[:, k, None]
            rate[body] += axis[:, k] * ddp[:, k, None] + _twist_cross(twist[body], moving)
            twist[body] += moving
    omega, v0 = twist[:, :, :3], twist[:, :, 3:]
    alpha, a0 = rate[:, :, :3], rate[:, :, 3:]
    spin = skew(omega)
    in_ground = np.concatenate(
        [skew(alpha) + spin @ spin, (a0 + cross(omega, v0) - skeleton.gravity)[..., None]], axis=3
    ).transpose(1, 0, 2, 3)
    T = np.zeros((frames, bodies, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = poses.R_ground_body, poses.p_ground_body, 1.0
    return in_ground @ T, T


def _twist_cross(
    one: Float[np.ndarray, "frames 6"], other: Float[np.ndarray, "frames 6"]
) -> Float[np.ndarray, "frames 6"]:
    """Rate of a twist that is fixed to a body moving with the first."""
    angular = cross(one[:, :3], other[:, :3])
    linear = cross(one[:, :3], other[:, 3:]) + cross(one[:, 3:], other[:, :3])
    return np.concatenate([angular, linear], axis=1)


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
