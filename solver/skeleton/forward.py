"""Forward kinematics of a whole trial: a few dozen array operations, whatever the number of frames."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.frames_at_once import by_frames, spans
from solver.skeleton.chain import Chain, Fixed, Moving, chain_of
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

    def at(self, frames: slice) -> "Poses":
        """Those of some frames."""
        return Poses(
            self.R_ground_body[frames],
            self.p_ground_body[frames],
            self.angular_ground[frames],
            self.linear_ground[frames],
            self.slope[frames],
        )

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
        frames, bodies, positions = q.shape[0], len(self.skeleton.bodies), self.chain.positions
        R_ground_body = np.empty((bodies, frames, 3, 3))
        p_ground_body = np.empty((bodies, frames, 3))
        R_after = np.empty((positions, frames, 3, 3))  # orientation once p_k has turned it
        anchor_ground = np.empty((positions, frames, 3))  # a point on the axis of p_k
        turns = self._turns(p)
        ground = np.broadcast_to(np.eye(3), (frames, 3, 3)), np.zeros((frames, 3))
        for body, steps in enumerate(self.chain.steps):
            parent = self.skeleton.joints[body].parent
            R, o = ground if parent < 0 else (R_ground_body[parent], p_ground_body[parent])
            for step in steps:
                if isinstance(step, Fixed):
                    o = o + R @ step.p if step.p.any() else o
                    R = R if _is_identity(step.R) else (R.reshape(-1, 3) @ step.R).reshape(R.shape)
                    continue
                k = step.index
                if step.kind == "translation":
                    o = o + p[:, k, None] * (R @ step.axis)
                else:
                    R = R @ turns[k]
                R_after[k], anchor_ground[k] = R, o
            R_ground_body[body], p_ground_body[body] = R, o
        axis_ground = (R_after @ self._axes[:, None, :, None])[..., 0]
        rotational = self._rotational[:, None, None]
        linear = np.where(rotational, cross(anchor_ground, axis_ground), axis_ground)
        return Poses(
            R_ground_body=R_ground_body.transpose(1, 0, 2, 3),
            p_ground_body=p_ground_body.transpose(1, 0, 2),
            angular_ground=(axis_ground * rotational).transpose(1, 0, 2),
            linear_ground=linear.transpose(1, 0, 2),
            slope=slope,
        )

    @cached_property
    def _moving(self) -> list[Moving]:
        moving = [s for steps in self.chain.steps for s in steps if isinstance(s, Moving)]
        return sorted(moving, key=lambda s: s.index)

    @cached_property
    def _axes(self) -> Float[np.ndarray, "positions 3"]:
        return np.array([s.axis for s in self._moving]).reshape(-1, 3)

    @cached_property
    def _rotational(self) -> Bool[np.ndarray, " positions"]:
        return np.array([s.kind == "rotation" for s in self._moving], dtype=bool)

    def _turns(self, p: Float[np.ndarray, "frames positions"]) -> Float[np.ndarray, "positions frames 3 3"]:
        """Rotation about each axis by its own p (Rodrigues); of no meaning for translations."""
        cross_matrix = skew(self._axes)
        sine, versine = np.sin(p).T[:, :, None, None], (1.0 - np.cos(p)).T[:, :, None, None]
        return np.eye(3) + sine * cross_matrix[:, None] + versine * (cross_matrix @ cross_matrix)[:, None]

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
        positions = np.empty((poses.p_ground_body.shape[0], len(self.marker_bodies), 3))
        for body in np.unique(self.marker_bodies):
            own = np.flatnonzero(self.marker_bodies == body)
            turned = self.marker_offsets[own] @ poses.R_ground_body[:, body].transpose(0, 2, 1)
            positions[:, own] = turned + poses.p_ground_body[:, body, None]
        return positions

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


def _is_identity(R: Float[np.ndarray, "3 3"]) -> bool:
    return bool((np.eye(3) == R).all())


def body_poses(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"]
) -> tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]]:
    """Orientation and origin [m] of every body in the ground frame.

    Args:
        skeleton: at any scale.
        q: generalized coordinates in the order of `skeleton.dofs` [rad or m].
    """
    kinematics, pieces = ForwardKinematics(skeleton), spans(len(q))
    if len(pieces) == 1:
        poses = kinematics.poses(q)
        return poses.R_ground_body, poses.p_ground_body
    bodies = len(skeleton.bodies)
    R_ground_body, p_ground_body = np.empty((len(q), bodies, 3, 3)), np.empty((len(q), bodies, 3))
    for some in pieces:
        poses = kinematics.poses(q[some])
        R_ground_body[some], p_ground_body[some] = poses.R_ground_body, poses.p_ground_body
    return R_ground_body, p_ground_body


def carried_joint_centres(
    skeleton: Skeleton, q: Float[np.ndarray, " dofs"]
) -> dict[str, dict[str, Float[np.ndarray, "3"]]]:
    """By body, where the bodies that hang on it have their origins, by name, in its frame [m].

    Args:
        skeleton: of these bodies.
        q: one pose; joints that slide carry further in some poses than in others.
    """
    R, p = (of_frames[0] for of_frames in body_poses(skeleton, q[None]))
    centres: dict[str, dict[str, np.ndarray]] = {name: {} for name in skeleton.body_names}
    for child, joint in enumerate(skeleton.joints):
        if joint.parent >= 0:
            from_parent = R[joint.parent].T @ (p[child] - p[joint.parent])
            centres[skeleton.body_names[joint.parent]][skeleton.body_names[child]] = from_parent
    return centres


def marker_positions(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "frames markers 3"]:
    """Model markers in the ground frame [m]; arguments as in `body_poses`."""
    kinematics = ForwardKinematics(skeleton)
    return by_frames(lambda some: kinematics.markers(kinematics.poses(some)), q)


def marker_jacobian(
    kinematics: ForwardKinematics, poses: Poses, markers_ground: Float[np.ndarray, "frames markers 3"]
) -> Float[np.ndarray, "frames coordinates dofs"]:
    """∂x_m/∂q of every frame; markers and their x, y, z in one axis."""
    twist = poses.twists()
    frames, markers = markers_ground.shape[:2]
    J = np.zeros((frames, markers, 3, kinematics.chain.dofs))
    for k, dof in enumerate(kinematics.chain.dof):
        moved = np.flatnonzero(kinematics.carries[k, kinematics.marker_bodies])
        by_dof = J[..., dof]
        by_dof[:, moved] += cross(twist[:, k, None, :3], markers_ground[:, moved]) + twist[:, k, None, 3:]
    return J.reshape(frames, 3 * markers, -1)


def point_jacobian(
    kinematics: ForwardKinematics, poses: Poses, body: int, point_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3 dofs"]:
    """∂(point)/∂q of a point fixed to a body."""
    twist = poses.twists()
    J = np.zeros((len(point_ground), 3, kinematics.chain.dofs))
    for k in np.flatnonzero(kinematics.carries[:, body]):
        J[:, :, kinematics.chain.dof[k]] += cross(twist[:, k, :3], point_ground) + twist[:, k, 3:]
    return J
