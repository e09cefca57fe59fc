"""Poses of a group of markers that keep their distances, from whichever of them a frame shows."""

import numpy as np
from jaxtyping import Float

from benchmarks.leg_joints import Poses
from solver.skeleton.rotations import nearest_rotation

FEWEST_MARKERS = 3
LEAST_WIDTH_M = 0.01  # markers nearer to one line do not tell how a cluster turns about it
ROUNDS = 3  # of shape and poses in turn


def cluster_poses(
    markers: Float[np.ndarray, "frames markers 3"],
) -> Poses:
    """Rotation and origin of a cluster against its mean shape; NaN where too few are seen, or all in a line.

    Args:
        markers: in the ground frame [m], NaN where unseen.
    """
    seen = np.isfinite(markers).all(axis=2)
    first = markers[np.argmax(seen.sum(axis=1))]
    if not np.isfinite(first).any():
        return np.full((len(markers), 3, 3), np.nan), np.full((len(markers), 3), np.nan)
    shape = first - np.nanmean(first, axis=0)
    for _ in range(ROUNDS):
        R, p = _laid_on(shape, markers)
        in_cluster = np.einsum("tji,tmj->tmi", R, markers - p[:, None])
        known = np.isfinite(in_cluster).all(axis=2).any(axis=0)
        shape[known] = np.nanmean(in_cluster[:, known], axis=0)
        shape -= np.nanmean(shape, axis=0)
    return _laid_on(shape, markers)


def _laid_on(shape: Float[np.ndarray, "markers 3"], markers: Float[np.ndarray, "frames markers 3"]) -> Poses:
    """The shape's pose on each frame (Kabsch), NaN where too little is seen."""
    both = np.isfinite(markers).all(axis=2) & np.isfinite(shape).all(axis=1)
    weight = both[:, :, None].astype(float)
    count = weight.sum(axis=1)
    enough = count[:, 0] >= FEWEST_MARKERS
    x, s = np.where(weight > 0, markers, 0.0), np.where(weight > 0, shape, 0.0)
    with np.errstate(invalid="ignore"):
        x_mean, s_mean = x.sum(axis=1) / count, s.sum(axis=1) / count
    R = np.full((len(markers), 3, 3), np.nan)
    p = np.full((len(markers), 3), np.nan)
    s_centred = (s - s_mean[:, None]) * weight
    s_centred[~enough] = 0.0
    spread = np.linalg.eigvalsh(np.einsum("tmi,tmj->tij", s_centred, s_centred))
    enough &= spread[:, 1] > LEAST_WIDTH_M**2
    x_centred, s_centred = (x - x_mean[:, None])[enough] * weight[enough], s_centred[enough]
    R[enough] = nearest_rotation(np.einsum("tmi,tmj->tij", x_centred, s_centred))
    p[enough] = x_mean[enough] - np.einsum("tij,tj->ti", R[enough], s_mean[enough])
    return R, p
