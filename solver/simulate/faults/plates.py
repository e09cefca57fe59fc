"""Force plates as a file holds them: what changes in its numbers when a plate, a cable or a program is wrong.

Every function takes the true plate and returns the recorded one, as the catalogue states it. Where a plate
reads exactly nothing it goes on reading nothing, unless said otherwise.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from solver.capture.capture import ForcePlate
from solver.skeleton.forward import cross

LOADED_N = 20.0  # vertical force with which a centre of pressure means something


def loaded(plate: ForcePlate, least_N: float = LOADED_N) -> Bool[np.ndarray, " samples"]:
    """Samples with a foot on the plate."""
    return (plate.force_ground[:, 1] > least_N) & np.isfinite(plate.cop_ground).all(axis=1)


def silent(plate: ForcePlate) -> Bool[np.ndarray, " samples"]:
    """Samples that a program has set to zero."""
    return (plate.force_ground == 0).all(axis=1)


def centre(plate: ForcePlate) -> Float[np.ndarray, "3"]:
    """Middle of the extent of the loaded centre of pressure [m]; the origin for a plate never stepped on."""
    points = plate.cop_ground[loaded(plate)]
    return (points.min(axis=0) + points.max(axis=0)) / 2 if len(points) else np.zeros(3)


def free_moment(plate: ForcePlate) -> Float[np.ndarray, "samples 3"]:
    """Moment about the file's centre of pressure; about the origin where it gives none [N·m]."""
    return plate.moment_ground - cross(np.nan_to_num(plate.cop_ground), plate.force_ground)


def rebuilt(
    plate: ForcePlate,
    force: Float[np.ndarray, "samples 3"],
    cop: Float[np.ndarray, "samples 3"],
    free: Float[np.ndarray, "samples 3"],
) -> ForcePlate:
    """The plate with other columns: force, centre of pressure (NaN unknown), moment about that point."""
    moment = free + cross(np.nan_to_num(cop), force)
    return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop)


def with_wrench(
    plate: ForcePlate, force: Float[np.ndarray, "samples 3"], moment: Float[np.ndarray, "samples 3"]
) -> ForcePlate:
    """The plate with another wrench about the ground origin, and the centre of pressure that goes with it."""
    known = np.isfinite(plate.cop_ground).all(axis=1)
    height = float(np.median(plate.cop_ground[known, 1])) if known.any() else 0.0
    pressed = known & (force[:, 1] > LOADED_N / 2)
    vertical = np.where(pressed, force[:, 1], np.nan)
    x = (moment[:, 2] + height * force[:, 0]) / vertical
    z = (height * force[:, 2] - moment[:, 0]) / vertical
    cop = np.stack([x, np.where(pressed, height, np.nan), z], axis=1)
    return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop)


def gained(plate: ForcePlate, gain_error: float) -> ForcePlate:
    """Recorded = (1 + gain_error) × true, force and moment; the centre of pressure stays."""
    return replace(
        plate,
        force_ground=(1 + gain_error) * plate.force_ground,
        moment_ground=(1 + gain_error) * plate.moment_ground,
    )


def biased(plate: ForcePlate, bias_N: Float[np.ndarray, "3"], while_unloaded: bool) -> ForcePlate:
    """A constant force added at the plate's centre; the loaded centre of pressure moves accordingly.

    Args:
        plate: true.
        bias_N: ground frame [N].
        while_unloaded: whether samples set to zero get it too.
    """
    on = np.ones(plate.samples, dtype=bool) if while_unloaded else ~silent(plate)
    added = np.where(on[:, None], bias_N, 0.0)
    moment = plate.moment_ground + cross(centre(plate), added)
    return with_wrench(plate, plate.force_ground + added, moment)


def moved(plate: ForcePlate, shift_m: Float[np.ndarray, "3"]) -> ForcePlate:
    """Recorded centre of pressure = true + shift; force and free moment stay."""
    known = np.isfinite(plate.cop_ground).all(axis=1)
    cop = np.where(known[:, None], plate.cop_ground + shift_m, np.nan)
    return rebuilt(plate, plate.force_ground, cop, free_moment(plate))


def turned(plate: ForcePlate, yaw_deg: float) -> ForcePlate:
    """Recorded force and centre of pressure = R_y(yaw) × true about the plate's centre."""
    turn = Rotation.from_euler("Y", yaw_deg, degrees=True)
    middle = centre(plate)
    cop = middle + turn.apply(plate.cop_ground - middle)
    return rebuilt(plate, turn.apply(plate.force_ground), cop, turn.apply(free_moment(plate)))


def tilted(plate: ForcePlate, tilt_x_deg: float, tilt_z_deg: float) -> ForcePlate:
    """Recorded force vectors = R(rotation vector (tilt_x, 0, tilt_z)) × true; centre of pressure stays."""
    tilt = Rotation.from_rotvec(np.radians([tilt_x_deg, 0.0, tilt_z_deg]))
    return rebuilt(plate, tilt.apply(plate.force_ground), plate.cop_ground, free_moment(plate))


def exchanged(one: ForcePlate, other: ForcePlate) -> tuple[ForcePlate, ForcePlate]:
    """Forces and free moments of two plates exchanged; each keeps its centre-of-pressure columns."""
    return (
        rebuilt(one, other.force_ground, one.cop_ground, free_moment(other)),
        rebuilt(other, one.force_ground, other.cop_ground, free_moment(one)),
    )


def misread_axes(plate: ForcePlate, axes: str) -> ForcePlate:
    """`x`: that component has the wrong sign; `xz`: the two are exchanged; centre of pressure stays."""
    force = plate.force_ground.copy()
    columns = ["xyz".index(axis) for axis in axes]
    force[:, columns] = -force[:, columns] if len(columns) == 1 else force[:, columns[::-1]]
    return rebuilt(plate, force, plate.cop_ground, free_moment(plate))


def blanked(plate: ForcePlate, samples: slice) -> ForcePlate:
    """No force at all over some samples."""
    force, moment, cop = plate.force_ground.copy(), plate.moment_ground.copy(), plate.cop_ground.copy()
    force[samples], moment[samples], cop[samples] = 0.0, 0.0, np.nan
    return replace(plate, force_ground=force, moment_ground=moment, cop_ground=cop)


def stances(plate: ForcePlate, shortest_s: float = 0.15) -> list[slice]:
    """Runs of samples in which the plate bears a foot, whole ones only (not cut by the recording's ends)."""
    on = loaded(plate)
    edges = np.flatnonzero(np.diff(on.astype(int)))
    starts = [int(e) + 1 for e in edges if on[e + 1]]
    runs = []
    for start in starts:
        ends = [int(e) + 1 for e in edges if e >= start and not on[e + 1]]
        if ends and (ends[0] - start) / plate.rate >= shortest_s:
            runs.append(slice(start, ends[0]))
    return runs


def numbered(plates: Sequence[ForcePlate], target: str) -> int:
    """Index of `plate_k`."""
    return int(target.removeprefix("plate_")) - 1
