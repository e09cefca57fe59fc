"""Segments' poses of a markerless system (ROTATION group of C3D files) as points that ride on the segments.

Theia3D writes no points, but where each segment's frame is: x to the right, y forwards, z up in a person who
stands upright with the palms forwards, origin at the proximal joint; that of the pelvis between the hips, of
the torso at the base of the neck. Each pose becomes three points: its origin, and one ahead of it and one
above it by `ARM` of the stature that the legs tell, so that they grow with the person as landmarks do.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.formats.c3d_contents import C3dContents
from solver.capture.formats.text_table import some_of
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

OF_LEGS, OF_ARMS = ("thigh", "shank", "foot", "toes"), ("uarm", "larm", "hand")
SEGMENTS = ("pelvis", "torso", *(f"{side}_{name}" for name in (*OF_LEGS, *OF_ARMS) for side in "rl"))
ARM = 0.05  # of stature; 50 in landmarks.toml
LEG = 0.491  # of stature: thigh and shank (Drillis & Contini 1966), as in the default body
ORTHONORMAL = 1e-3  # of RᵀR − 1; single precision leaves 1e-6


@dataclass(frozen=True)
class PosePoints:
    """Points on the segments, in the file's unit and axes."""

    names: tuple[str, ...]
    positions: Float[np.ndarray, "poses points 3"]  # NaN where a segment has no pose
    rate: float  # [Hz]
    notes: tuple[Note, ...]


def pose_points(contents: C3dContents) -> PosePoints:
    """Points for the fit, as `r_thigh`, `r_thigh_y`, `r_thigh_z`.

    Args:
        contents: of a file with rotations.

    Raises:
        CaptureError: none of the segments is known, or no whole leg is among them.
    """
    labels = contents.words("ROTATION", "LABELS")[: contents.rotations.shape[1]]
    column: dict[str, int] = {}
    for k, label in enumerate(labels):
        column.setdefault(label.lower().removesuffix("_4x4"), k)
    known = [name for name in SEGMENTS if name in column]
    matrices = contents.rotations[:, [column[name] for name in known], :16]
    poses = matrices.reshape(len(matrices), len(known), 4, 4).swapaxes(2, 3)  # stored by columns
    reliability = contents.rotations[:, [column[name] for name in known], 16]
    R, p = poses[..., :3, :3], poses[..., :3, 3]
    posed = _posed(R, p) & (reliability >= 0)
    p = np.where(posed[..., None], p, np.nan)
    arm = ARM * _stature(contents, dict(zip(known, p.swapaxes(0, 1), strict=True)), labels)
    points = np.stack([p, p + arm * R[..., 1], p + arm * R[..., 2]], axis=2)
    rest = sorted(column.keys() - {*known, "worldbody"})
    notes = noted(
        Kind.LABELS,
        f"{contents.path.name}: poses of {len(known)} segments, no points; three points on each are fitted",
    )
    if rest:
        notes += noted(Kind.LEFT_OUT, f"{contents.path.name}: poses that are not used: {some_of(rest)}")
    rate = contents.rate * len(poses) / len(contents.points)
    said = contents.number("ROTATION", "RATE", rate)
    if abs(said / rate - 1) > 1e-3:
        notes += noted(
            Kind.OTHER,
            f"{contents.path.name}: ROTATION:RATE says {said:g} Hz, its count of poses {rate:g} Hz",
        )
    names = tuple(f"{name}{end}" for name in known for end in ("", "_y", "_z"))
    return PosePoints(names, points.reshape(len(points), -1, 3), rate, notes)


def _posed(
    R: Float[np.ndarray, "poses segments 3 3"], p: Float[np.ndarray, "poses segments 3"]
) -> Bool[np.ndarray, "poses segments"]:
    """Where a matrix is a pose: files have zeros or no numbers elsewhere."""
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(-1, -2))
        return (off < ORTHONORMAL) & np.isfinite(p).all(axis=-1)


def _stature(
    contents: C3dContents, origin: dict[str, Float[np.ndarray, "poses 3"]], labels: tuple[str, ...]
) -> float:
    """By the legs [file's unit]."""
    lengths = []
    for side in "rl":
        chain = [origin[name] for segment in OF_LEGS[:3] if (name := f"{side}_{segment}") in origin]
        if len(chain) == 3:
            lengths.append(np.linalg.norm(np.diff(chain, axis=0), axis=2).sum(axis=0))
    whole = np.concatenate(lengths) if lengths else np.zeros(0)
    if not np.isfinite(whole).any():
        raise CaptureError(
            f"{contents.path}: it holds poses of segments, no points, and no whole leg among them (r_thigh, "
            f"r_shank and r_foot, or l_…, as Theia3D calls them): {some_of(labels)}. Export the whole "
            "skeleton, or its points."
        )
    return float(np.nanmedian(whole)) / LEG
