"""Rotation matrices, over whole trials at once."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def skew(v: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """The matrix [v]× with [v]× w = v × w."""
    matrix = np.zeros((*v.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return matrix


def rotation_about(
    axis: Float[np.ndarray, "3"], angle: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 3 3"]:
    """Rotations by `angle` [rad] about a unit `axis` (Rodrigues)."""
    cross = skew(axis)
    sine, versine = np.sin(angle)[:, None, None], (1 - np.cos(angle))[:, None, None]
    return np.eye(3) + sine * cross + versine * (cross @ cross)


def body_fixed_xyz(angles: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Rotation from OpenSim's orientation triple: about x, then the new y, then the new z [rad]."""
    turns = [rotation_about(axis, angles[i : i + 1])[0] for i, axis in enumerate(np.eye(3))]
    return turns[0] @ turns[1] @ turns[2]


def body_fixed_angles(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """OpenSim's orientation triple of a rotation [rad]: `body_fixed_xyz` backwards, gimbal lock included."""
    x = np.arctan2(-R[1, 2], R[2, 2])
    y = np.arctan2(R[0, 2], np.hypot(R[0, 0], R[0, 1]))
    sine, cosine = np.sin(x), np.cos(x)
    z = np.arctan2(cosine * R[1, 0] + sine * R[2, 0], cosine * R[1, 1] + sine * R[2, 1])
    return np.array([x, y, z])


def nearest_rotation(M: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """The rotation R that maximizes tr(RᵀM): Kabsch's orthogonal Procrustes problem."""
    U, _, Vt = np.linalg.svd(M)
    U[..., :, 2] *= np.linalg.det(U @ Vt)[..., None]
    return U @ Vt


def quaternions(R: Float[np.ndarray, "*batch 3 3"], **how: bool) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions, the scalar last; NaN where there is no rotation.

    Args:
        R: rotations; NaN where none is known.
        how: as `Rotation.as_quat` takes it.
    """
    flat = R.reshape(-1, 3, 3)
    known = np.isfinite(flat).all(axis=(1, 2))
    turned = np.full((len(flat), 4), np.nan)
    turned[known] = Rotation.from_matrix(flat[known]).as_quat(**how)
    return turned.reshape(*R.shape[:-2], 4)
