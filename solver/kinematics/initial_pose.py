"""Start poses for any heading and posture: rigid alignment of a few postures, the best after refinement."""

import numpy as np
from jaxtyping import Float, Int

from solver.kinematics.frame_solver import PoseProblem, solve_frames
from solver.kinematics.root_joint import RootJoint
from solver.skeleton.rotations import nearest_rotation
from solver.skeleton.skeleton import Skeleton

FLEXED = {"hip_flexion": 1.4, "knee_angle": 1.4, "knee_flexion": 1.4}  # rad; sitting, squatting, landing
ONE_WAY_RAD = 1.5  # range of a joint that may bend far to one side
SLIGHTLY_BENT = 0.2  # of that range
KEPT = 2  # starts a frame that are refined to the end
REACHING = {"arm_flex": 1.2, "arm_add": -0.6, "elbow_flex": 1.2}  # rad; arms up and in front


def start_postures(skeleton: Skeleton) -> Float[np.ndarray, "postures dofs"]:
    """Upright, flexed, and upright with raised arms; by the field's coordinate names, within the ranges.

    Joints that bend one way, as elbows do, start a little bent: a straight one may as well bend backwards and
    turn about itself, where one marker beyond it is all that tells.
    """
    low, high = np.array([c.range for c in skeleton.free_coordinates]).reshape(-1, 2).T
    upright = np.clip(skeleton.default_q, low, high)
    room = high - low
    wide = np.isfinite(room) & (room > ONE_WAY_RAD) & (room < 2 * np.pi)
    little = SLIGHTLY_BENT * np.where(wide, room, 0.0)
    upright += np.where(upright - low < 0.5 * little, little, 0.0)
    upright -= np.where(high - upright < 0.5 * little, little, 0.0)
    postures = [upright, _bent(skeleton, upright, FLEXED), _bent(skeleton, upright, REACHING)]
    return np.unique(np.array(postures), axis=0)


def initial_poses(
    problem: PoseProblem,
    root: RootJoint,
    frames: Int[np.ndarray, " some"],
) -> tuple[Float[np.ndarray, "some dofs"], Float[np.ndarray, " some"]]:
    """Poses of single frames from nothing but their markers.

    Args:
        problem: markers and skeleton.
        root: of the skeleton.
        frames: which frames; each is started from every posture, aligned by all markers and by the root's.

    Returns:
        The best pose of each frame, and its robust cost.
    """
    skeleton = problem.kinematics.skeleton
    postures = start_postures(skeleton)
    near_root = problem.kinematics.marker_bodies == root.body
    weights = [np.ones(len(near_root))]
    if near_root.sum() >= 3:
        weights.append(np.where(near_root, 1.0, 0.02))
    starts = [aligned(problem, root, posture, frames, weight) for posture in postures for weight in weights]
    which = np.tile(frames, len(starts))
    rough, cost = solve_frames(problem, np.concatenate(starts), which, robust=False, max_iterations=8)
    order = cost.reshape(len(starts), -1).argsort(axis=0)[:KEPT]
    kept = (order * len(frames) + np.arange(len(frames))).ravel()
    q, cost = solve_frames(problem, rough[kept], which[kept])
    best = cost.reshape(-1, len(frames)).argmin(axis=0)
    index = best * len(frames) + np.arange(len(frames))
    return q[index], cost[index]


def aligned(
    problem: PoseProblem,
    root: RootJoint,
    posture: Float[np.ndarray, " dofs"],
    frames: Int[np.ndarray, " some"],
    weight: Float[np.ndarray, " markers"],
) -> Float[np.ndarray, "some dofs"]:
    """The posture, moved as a rigid whole onto each frame's markers (Kabsch)."""
    poses = problem.kinematics.poses(posture[None])
    model = problem.kinematics.markers(poses)[0]
    w = problem.seen[frames] * weight
    w = w / np.maximum(w.sum(axis=1, keepdims=True), 1e-12)
    observed = problem.observed[frames]
    centre_model = w @ model
    centre_observed = np.einsum("tm,tmi->ti", w, observed)
    covariance = np.einsum(
        "tm,tmi,tmj->tij", w, observed - centre_observed[:, None], model[None] - centre_model[:, None]
    )
    R = nearest_rotation(covariance)
    R_ground_root = R @ poses.R_ground_body[0, root.body]
    arm = poses.p_ground_body[0, root.body] - centre_model
    p_ground_root = centre_observed + (R @ arm[:, :, None])[:, :, 0]
    q = np.tile(posture, (len(frames), 1))
    q[:, root.dofs] = root.coordinates(R_ground_root, p_ground_root)
    return q


def _bent(
    skeleton: Skeleton, upright: Float[np.ndarray, " dofs"], angles: dict[str, float]
) -> Float[np.ndarray, " dofs"]:
    posture = upright.copy()
    for i, coordinate in enumerate(skeleton.free_coordinates):
        stem = coordinate.name.removesuffix("_r").removesuffix("_l")
        if stem in angles:
            low, high = coordinate.range
            bend = angles[stem] if low <= angles[stem] <= high else -angles[stem]
            posture[i] = np.clip(bend, low, high)
    return posture
