"""Markers that slip, are exchanged, lie in a wrongly scaled room, or ride on soft tissue."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from solver.capture.capture import Markers
from solver.simulate.faults.drawing import FEWEST_MARKERS


def registered(
    markers: Markers, names: list[str]
) -> tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]]:
    """The frame of a group of markers: rotation from their shape, and centroid; gaps are bridged.

    Kabsch W. Acta Cryst A 1976; 32: 922-923. The shape is that of the middle frame that sees them all.
    """
    points = markers.positions_ground[:, [markers.names.index(name) for name in names]]
    whole = np.flatnonzero(np.isfinite(points).all(axis=(1, 2)))
    shape = points[whole[len(whole) // 2]] if len(whole) else np.full(points.shape[1:], np.nan)
    R = np.full((len(points), 3, 3), np.nan)
    centroid = np.full((len(points), 3), np.nan)
    for t, seen in enumerate(np.isfinite(points).all(axis=2)):
        if seen.sum() < FEWEST_MARKERS:
            continue
        here, there = points[t, seen], shape[seen]
        u, _, vt = np.linalg.svd((here - here.mean(axis=0)).T @ (there - there.mean(axis=0)))
        sign = np.sign(np.linalg.det(u @ vt))
        R[t] = u @ np.diag([1.0, 1.0, sign]) @ vt
        centroid[t] = here.mean(axis=0) + R[t] @ (shape.mean(axis=0) - there.mean(axis=0))
    return _filled_rotations(R), _filled(centroid)


def slipped(
    markers: Markers,
    name: str,
    shift: Float[np.ndarray, "3"],
    time_s: float,
    R_ground: Float[np.ndarray, "frames 3 3"],
) -> Markers:
    """The marker displaced by `shift` [m], in axes that turn with its segment, from a time on."""
    positions = markers.positions_ground.copy()
    after = markers.times - markers.start_time >= time_s
    positions[after, markers.names.index(name)] += (R_ground @ shift)[after]
    return replace(markers, positions_ground=positions)


def swapped(markers: Markers, one: str, other: str, first: int, last: int) -> Markers:
    """Two markers exchanged from a frame to another, end exclusive."""
    positions = markers.positions_ground.copy()
    a, b = markers.names.index(one), markers.names.index(other)
    positions[first:last, [a, b]] = positions[first:last, [b, a]]
    return replace(markers, positions_ground=positions)


def rescaled(markers: Markers, scale: float) -> Markers:
    """Recorded marker = scale × true, about the laboratory's origin."""
    return replace(markers, positions_ground=scale * markers.positions_ground)


def soft(
    markers: Markers,
    names: list[str],
    *,
    R_ground: Float[np.ndarray, "frames 3 3"],
    R_next: Float[np.ndarray, "frames 3 3"],
    direction: Float[np.ndarray, "3 3"],
    rms_m: float,
) -> Markers:
    """All markers of a segment displaced together with the angle between it and its neighbour.

    The displacement in the segment's axes is direction · (rotation vector to the neighbour less its mean),
    scaled so that its length is `rms_m` in the mean square over frames.
    """
    angles = Rotation.from_matrix(R_ground.transpose(0, 2, 1) @ R_next)
    turn = (angles.mean().inv() * angles).as_rotvec()
    move = (turn - turn.mean(axis=0)) @ direction.T
    move *= rms_m / np.sqrt(np.mean(np.sum(move**2, axis=1)))
    positions = markers.positions_ground.copy()
    columns = [markers.names.index(name) for name in names]
    positions[:, columns] += (R_ground @ move[..., None])[..., 0][:, None]
    return replace(markers, positions_ground=positions)


def _filled(values: Float[np.ndarray, "frames n"]) -> Float[np.ndarray, "frames n"]:
    """Gaps bridged by straight lines, ends held."""
    known: Bool[np.ndarray, " frames"] = np.isfinite(values).all(axis=1)
    t = np.arange(len(values))
    return np.stack([np.interp(t, t[known], column[known]) for column in values.T], axis=1)


def _filled_rotations(R: Float[np.ndarray, "frames 3 3"]) -> Float[np.ndarray, "frames 3 3"]:
    flat = _filled(R.reshape(len(R), 9)).reshape(-1, 3, 3)
    u, _, vt = np.linalg.svd(flat)
    return u @ vt
