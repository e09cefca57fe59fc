"""Moments that a file lost where its force passes through zero, put back between the samples around."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.centre_of_pressure import Surface, centre_of_pressure

POINT_LOST_N = 50.0  # [N] with less, programs write no centre of pressure, or one that digits do not hold


def moments_lost(plate: ForcePlate) -> Bool[np.ndarray, " samples"]:
    """Samples whose moment hangs on a centre of pressure that a small force does not tell.

    Args:
        plate: as its file has it; one without columns for the point loses nothing.
    """
    if plate.point_ground is None:
        return np.zeros(plate.samples, dtype=bool)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(plate.force_ground[:, 1]) < POINT_LOST_N)


def with_moments_bridged(
    plate: ForcePlate, lost: Bool[np.ndarray, " samples"], surface: Surface, least_N: float
) -> ForcePlate:
    """The plate with the moments of these samples made anew from points between their neighbours'.

    Args:
        plate: with its true forces.
        lost: samples whose moment is not known.
        surface: where feet press.
        least_N: of the vertical force, from which on somebody is on the plate.
    """
    vertical = plate.force_ground[:, 1]
    with np.errstate(invalid="ignore"):
        loaded = vertical > least_N
    wanted, known = loaded & lost, loaded & ~lost
    if not wanted.any() or known.sum() < 2:
        return plate
    force, moment = plate.force_ground, plate.moment_ground
    points = centre_of_pressure(force, moment, surface)
    free = moment - np.cross(points, force)
    order = np.arange(plate.samples)

    def between(values: Float[np.ndarray, "samples 3"]) -> Float[np.ndarray, "wanted 3"]:
        return np.stack([np.interp(order[wanted], order[known], v[known]) for v in values.T], axis=1)

    bridged = moment.copy()
    bridged[wanted] = np.cross(between(points), force[wanted]) + between(free)
    return replace(plate, moment_ground=bridged)
