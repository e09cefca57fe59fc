"""Centre of pressure and free moment from a wrench about the ground origin, on the plate's surface."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.capture.capture import ForcePlate

UNEVEN_M = 0.01  # centres of pressure whose height varies by more tell of a ramp, not of a plate out of level
FLAT_PLANE_M = 0.003  # and so well must a plane describe them, or the surface counts as level


@dataclass(frozen=True)
class Surface:
    """The plane that feet press on."""

    point_ground: Float[np.ndarray, "3"]  # [m]
    normal_ground: Float[np.ndarray, "3"]  # unit, upwards


LEVEL_GROUND = Surface(np.zeros(3), np.array([0.0, 1.0, 0.0]))


def surface_of(plate: ForcePlate) -> Surface:
    """The plate's surface: its corners' plane, else through the file's centres of pressure, else y = 0."""
    if plate.corners_ground is not None and np.isfinite(plate.corners_ground).all():
        return _plane(plate.corners_ground)
    pressed = plate.cop_ground[np.isfinite(plate.cop_ground).all(axis=1)]
    if not len(pressed):
        return LEVEL_GROUND
    middle = np.median(pressed, axis=0)
    level = Surface(middle, LEVEL_GROUND.normal_ground)
    if np.ptp(np.percentile(pressed[:, 1], [5, 95])) < UNEVEN_M:
        return level
    plane = _plane(pressed)
    off_plane = np.abs((pressed - plane.point_ground) @ plane.normal_ground)
    return plane if np.percentile(off_plane, 95) < FLAT_PLANE_M else level


def centre_of_pressure(
    force_ground: Float[np.ndarray, "samples 3"],
    moment_ground: Float[np.ndarray, "samples 3"],
    surface: Surface,
) -> Float[np.ndarray, "samples 3"]:
    """Where the wrench's moment is along the surface's normal: p = p₀ + n × M₀ / (n · F), M₀ = M − p₀ × F.

    Args:
        force_ground: [N].
        moment_ground: about the ground origin [N·m].
        surface: where feet press.

    Returns:
        [m]; NaN where no force presses on the surface.
    """
    moment_at_point = moment_ground - np.cross(surface.point_ground, force_ground)
    pressing = force_ground @ surface.normal_ground
    pressing = np.where(pressing > 0, pressing, np.nan)
    return surface.point_ground + np.cross(surface.normal_ground, moment_at_point) / pressing[:, None]


def _plane(points: Float[np.ndarray, "points 3"]) -> Surface:
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre, full_matrices=False)[2][2]
    if abs(normal[1]) < np.cos(
        np.radians(60)
    ):  # points along a line leave the plane open; nobody stands on a wall
        normal = LEVEL_GROUND.normal_ground
    return Surface(centre, normal * np.sign(normal[1]))
