"""A frame that goes with the person: at the root joint's centre, turned to where they head.

What a body model gets wrong goes with the body. In the ground frame a walk around a corner would change it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from solver.common.frames_at_once import by_frames
from solver.dynamics.root_wrench import about_point, root_centre
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, cross
from solver.skeleton.skeleton import Skeleton

SMOOTHED_S = 0.3  # [s] over it the pelvis's turning to and fro within a stride is averaged out


@dataclass(frozen=True)
class HeadingFrame:
    """x forward, y up, z to the right of the person, frame by frame."""

    origin_ground: Float[np.ndarray, "frames 3"]  # [m]
    R_ground_heading: Float[np.ndarray, "frames 3 3"]

    def between(self, start: int, end: int) -> "HeadingFrame":
        """Frames `start` to `end` (excluded) alone."""
        return HeadingFrame(self.origin_ground[start:end], self.R_ground_heading[start:end])

    def to_ground(self, wrenches: Float[np.ndarray, "frames 6 n"]) -> Float[np.ndarray, "frames 6 n"]:
        """From force and moment here to force [N] and moment about the ground origin [N·m], ground frame."""
        force, moment = (self.R_ground_heading @ part for part in (wrenches[:, :3], wrenches[:, 3:]))
        lever = np.cross(self.origin_ground[:, :, None], force, axis=1)
        return np.concatenate([force, moment + lever], axis=1)

    def from_ground(self, wrench_ground: Float[np.ndarray, "frames 6"]) -> Float[np.ndarray, "frames 6"]:
        """The other way round, of one wrench a frame."""
        about = about_point(wrench_ground, self.origin_ground).reshape(-1, 2, 3)
        return (about @ self.R_ground_heading).reshape(-1, 6)

    def points(self, points_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 3"]:
        """Points seen from here [m]."""
        return ((points_ground - self.origin_ground)[:, None] @ self.R_ground_heading)[:, 0]


def heading_frame(skeleton: Skeleton, motion: Motion) -> HeadingFrame:
    """Of a motion; forward is the root body's x axis, as OpenSim's pelvis has it, smoothed over a stride.

    Args:
        skeleton: of the motion.
        motion: of the markers alone; no force has a say in it.
    """
    root, kinematics = root_joint(skeleton), ForwardKinematics(skeleton)

    def forward_and_centre(q: Float[np.ndarray, "some dofs"]) -> Float[np.ndarray, "some 6"]:
        poses = kinematics.poses(q)
        return np.hstack([poses.R_ground_body[:, root.body, :, 0], root_centre(root, poses)])

    forward, centre = np.split(by_frames(forward_and_centre, motion.q), 2, axis=1)
    forward[:, 1] = 0.0
    forward = gaussian_filter1d(forward, SMOOTHED_S * motion.rate, axis=0, mode="nearest")
    length = np.linalg.norm(forward, axis=1, keepdims=True)
    forward = np.where(length > 1e-6, forward / np.maximum(length, 1e-6), (1.0, 0.0, 0.0))
    up = np.broadcast_to([0.0, 1.0, 0.0], forward.shape)
    R_ground_heading = np.stack([forward, up, cross(forward, up)], axis=2)
    return HeadingFrame(centre, R_ground_heading)
