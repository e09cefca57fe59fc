"""Forward kinematics of a whole trial: a few dozen array operations, whatever the number of frames."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.skeleton.chain import Chain, Fixed, chain_of
from solver.skeleton.rotations import skew
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class Poses:
    """Where everything is, frame by frame, in the ground frame.

    A unit of p_k's velocity moves the point x (fixed to a body that p_k carries) with
    `angular[k] × x + linear[k]`.
    """

    R_ground_body: Float[np.ndarray, "frames bodies 3 3"]
    p_ground_body: Float[np.ndarray, "frames bodies 3"]  # [m]
    angular_ground: Float[np.ndarray, "frames positions 3"]
    linear_ground: Float[np.ndarray, "frames positions 3"]  # of the point at the ground origin
    slope: Float[np.ndarray, "frames positions"]  # Φ', the diagonal

    def twists(self) -> Float[np.ndarray, "frames positions 6"]:
        """Columns of the body Jacobians about the ground origin, by the driving q̇: [angular, linear]."""
        columns = np.concatenate([self.angular_ground, self.linear_ground], axis=2)
        return columns * self.slope[:, :, None]


class ForwardKinematics:
    """The compiled chain of one skeleton."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.chain: Chain = chain_of(skeleton)

    def poses(self, q: Float[np.ndarray, "frames dofs"]) -> Poses:
        """Poses of all bodies and axes.

        Args:
            q: generalized coordinates in the order of `skeleton.dofs` [rad or m].
        """
        p, slope, _ = self.chain.couple(q)
        frames, bodies = q.shape[0], len(self.skeleton.bodies)
        sine, versine = np.sin(p), 1.0 - np.cos(p)
        R_ground = np.empty((bodies, frames, 3, 3))
        o_ground = np.empty((bodies, frames, 3))
        angular = np.zeros((self.chain.positions, frames, 3))
        linear = np.zeros((self.chain.positions, frames, 3))
        R0, o0 = np.broadcast_to(np.eye(3), (frames, 3, 3)), np.zeros((frames, 3))
        for body, steps in enumerate(self.chain.steps):
            parent = self.skeleton.joints[body].parent
            R, o = (R0, o0) if parent < 0 else (R_ground[parent], o_ground[parent])
            for step in steps:
                if isinstance(step, Fixed):
                    o = o + R @ step.p
                    R = _times_constant(R, step.R)
                    continue
                axis_ground = R @ step.axis
                k = step.index
                if step.kind == "translation":
                    linear[k] = axis_ground
                    o = o + p[:, k, None] * axis_ground
                else:
                    angular[k] = axis_ground
                    linear[k] = cross(o, axis_ground)
                    cross_matrix = skew(step.axis)
                    turned = _times_constant(R, cross_matrix)
                    R = R + sine[:, k, None, None] * turned
                    R += versine[:, k, None, None] * _times_constant(turned, cross_matrix)
            R_ground[body], o_ground[body] = R, o
        return Poses(
            R_ground_body=R_ground.transpose(1, 0, 2, 3),
            p_ground_body=o_ground.transpose(1, 0, 2),
            angular_ground=angular.transpose(1, 0, 2),
            linear_ground=linear.transpose(1, 0, 2),
            slope=slope,
        )

    @cached_property
    def marker_bodies(self) -> Int[np.ndarray, " markers"]:
        """Body index of each model marker."""
        return np.array([m.body for m in self.skeleton.markers], dtype=int)

    @cached_property
    def marker_offsets(self) -> Float[np.ndarray, "markers 3"]:
        """Position of each model marker in its body's frame [m]."""
        return np.array([m.position_body for m in self.skeleton.markers]).reshape(-1, 3)

    def markers(self, poses: Poses) -> Float[np.ndarray, "frames markers 3"]:
        """Positions of the model markers in the ground frame [m]."""
        R = poses.R_ground_body[:, self.marker_bodies]
        turned = (R @ self.marker_offsets[None, :, :, None])[..., 0]
        return turned + poses.p_ground_body[:, self.marker_bodies]

    @cached_property
    def carries(self) -> Bool[np.ndarray, "positions bodies"]:
        """Whether p_k moves body b."""
        joints = self.skeleton.joints
        below = np.zeros((len(joints), len(joints)), dtype=bool)
        for body, joint in enumerate(joints):
            below[:, body] = below[:, joint.parent] if joint.parent >= 0 else False
            below[body, body] = True
        return below[self.chain.body]


def cross(
    a: Float[np.ndarray, "*batch 3"], b: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 3"]:
    """A × b; several times faster than numpy.cross on stacks."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def _times_constant(
    R: Float[np.ndarray, "frames 3 3"], M: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "frames 3 3"]:
    """R M for one M: a single matrix product over all frames."""
    return (R.reshape(-1, 3) @ M).reshape(R.shape)


def body_poses(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"]
) -> tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]]:
    """Orientation and origin [m] of every body in the ground frame.

    Args:
        skeleton: at any scale.
        q: generalized coordinates in the order of `skeleton.dofs` [rad or m].
    """
    poses = ForwardKinematics(skeleton).poses(q)
    return poses.R_ground_body, poses.p_ground_body


def marker_positions(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "frames markers 3"]:
    """Model markers in the ground frame [m]; arguments as in `body_poses`."""
    kinematics = ForwardKinematics(skeleton)
    return kinematics.markers(kinematics.poses(q))
