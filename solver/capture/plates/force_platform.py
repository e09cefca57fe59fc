"""Force platforms of a C3D file, as wrenches about the laboratory's origin.

The plate frame follows from the corners, which are numbered by the quadrants of the plate's own x-y plane: x
runs from corner 2 to 1, y from corner 4 to 1, z = x × y (downwards on plates that keep to the specification).
Source: The C3D File Format User Guide (Motion Lab Systems 2008), FORCE_PLATFORM group.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.capture.formats.c3d_contents import C3dContents
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import FEWEST_JUDGED, JUDGED_N, UNTARED_SHARE

CHANNELS_OF_TYPE = {1: 6, 2: 6, 3: 8, 4: 6}


ZERO_LIMIT_N = 50.0  # more than drift: on the FORCE_PLATFORM:ZERO frames somebody stood there
SHORTEST_SIDE_M = 0.1  # corners nearer to each other are garbage
LONGEST_SIDE_M = 6.0  # belts are shorter; corners farther apart are garbage
FARTHEST_CORNER_M = 100.0  # corners farther from the origin are garbage
MOMENT_UNITS = {
    **dict.fromkeys(("nm", "ntm", "newtonmeter", "newtonmeters"), 1.0),
    **dict.fromkeys(("nmm", "ntmm", "newtonmillimeter", "newtonmillimeters"), 1e-3),
    **dict.fromkeys(("ncm", "ntcm"), 1e-2),
}
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}
Wrench = tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"]]
INSIDE_MARGIN = 1.25  # of half a side: room for drift of the signals and misplaced corners
INSIDE_SHARE = 0.8  # of loaded samples inside: confirms a unit
MIDDLE_M = 0.005  # feet press farther from the middle than that; levers a thousandth of theirs do not
CALIBRATED_SPREAD = 0.03  # ANALOG:SCALE over CAL_MATRIX agrees that well among channels


@dataclass(frozen=True)
class PlatformSignals:
    """What one platform recorded, and what its file says about it."""

    kind: int  # FORCE_PLATFORM:TYPE
    signals: Float[np.ndarray, "samples channels"]
    units: tuple[str, ...]  # ANALOG:UNITS of the channels
    scales: Float[np.ndarray, " channels"]  # ANALOG:SCALE of the channels
    metres: float  # per POINT:UNITS
    origin: Float[np.ndarray, "3"]  # FORCE_PLATFORM:ORIGIN [m]
    half_sides: Float[np.ndarray, "2"]  # along the plate's x and y [m]
    calibration: Float[np.ndarray, "6 6"] | None = None  # CAL_MATRIX
    cop_polynomial: Float[np.ndarray, "12"] | None = None  # FPCOPPOLY, of lengths in POINT:UNITS


def wrench_on_surface(
    plate: PlatformSignals,
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """Force [N] and moment about the middle of the surface [N·m] in plate axes, as recorded; and notes."""
    if plate.kind == 1:
        return _centre_and_free_moment(plate)
    if plate.kind == 3:
        return _eight_channels(plate)
    return _force_and_moment(plate)


def _centre_and_free_moment(
    plate: PlatformSignals,
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """Type 1: force, centre of pressure from the middle of the surface, free moment."""
    force, px, py, free = plate.signals[:, :3], *plate.signals[:, 3:6].T
    nought = np.zeros_like(px)

    def wrench(metres: float) -> Wrench:
        centre = np.stack([px, py, nought], axis=1) * metres
        twist = MOMENT_UNITS.get(_word(plate.units[5]), metres)
        return force, np.cross(centre, force) + np.stack([nought, nought, free * twist], axis=1)

    declared = LENGTH_UNITS.get(plate.units[3].strip().lower(), plate.metres)
    return _with_likely_unit(
        plate, wrench, declared, units={"m": 1.0, "mm": 1e-3}, what="centres of pressure"
    )


def _force_and_moment(
    plate: PlatformSignals,
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """Types 2 and 4: force and moment about the sensors' origin; type 4 through the calibration matrix."""
    channels = plate.signals
    notes: tuple[Note, ...] = ()
    if plate.kind == 4 and plate.calibration is not None:
        if _already_calibrated(plate.scales, plate.calibration):
            notes = noted(
                Kind.OTHER,
                "ANALOG:SCALE holds the calibration already; CAL_MATRIX is not applied a second time",
            )
        else:
            channels = channels @ plate.calibration.T
    force, moment = channels[:, :3], channels[:, 3:6]
    r_sensor_surface, origin_notes = _below_surface(plate.origin)
    lever = np.cross(force, r_sensor_surface)

    def wrench(newton_metres: float) -> Wrench:
        return force, moment * newton_metres + lever

    declared = MOMENT_UNITS.get(_word(plate.units[3]), plate.metres)
    units = {"N·m": 1.0, "N·mm": 1e-3}
    force, moment, unit_notes = _with_likely_unit(plate, wrench, declared, units=units, what="moments")
    return force, moment, (*notes, *origin_notes, *unit_notes)


def _eight_channels(
    plate: PlatformSignals,
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """Type 3: shear force of pairs of sensors and vertical force of each of the four.

    ORIGIN holds half the distances between the sensors, and their (negative) height above the surface.
    """
    x12, x34, y14, y23, z1, z2, z3, z4 = plate.signals.T
    force = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
    a, b = np.abs(plate.origin[:2])
    height = np.array([0.0, 0.0, -abs(plate.origin[2])])
    moment = np.stack(
        [b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4), b * (x34 - x12) + a * (y14 - y23)], axis=1
    ) + np.cross(force, height)
    if a == 0 or b == 0:
        note = Note(
            Kind.PLATES,
            "FORCE_PLATFORM:ORIGIN lacks the distances of the sensors; the force is placed in the middle",
        )
        return force, np.zeros_like(force), (note,)
    if plate.cop_polynomial is None or not np.any(plate.cop_polynomial):
        return force, moment, ()
    return (
        force,
        _straightened(plate, force, moment),
        noted(Kind.PLATES, "centre of pressure corrected by FPCOPPOLY"),
    )


def _straightened(
    plate: PlatformSignals, force: Float[np.ndarray, "samples 3"], moment: Float[np.ndarray, "samples 3"]
) -> Float[np.ndarray, "samples 3"]:
    """The moment after Kistler's correction of the centre of pressure, which errs towards the rim."""
    assert plate.cop_polynomial is not None
    c = plate.cop_polynomial
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.where(force[:, 2] == 0, 0.0, -moment[:, 1] / force[:, 2]) / plate.metres
        y = np.where(force[:, 2] == 0, 0.0, moment[:, 0] / force[:, 2]) / plate.metres
    half_x, half_y = plate.half_sides / plate.metres
    on_plate = (np.abs(x) < half_x) & (np.abs(y) < half_y)
    dx = (c[0] * y**4 + c[1] * y**2 + c[2]) * x**3 + (c[3] * y**4 + c[4] * y**2 + c[5]) * x
    dy = (c[6] * x**4 + c[7] * x**2 + c[8]) * y**3 + (c[9] * x**4 + c[10] * x**2 + c[11]) * y
    shift = np.stack([dx, dy, np.zeros_like(dx)], axis=1) * plate.metres
    vertical = force * np.array([0.0, 0.0, 1.0])
    return moment - np.where(on_plate[:, None], np.cross(shift, vertical), 0.0)


def _below_surface(origin: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], tuple[Note, ...]]:
    """The vector from the sensors to the surface: its z is negative, since the plate's z axis points down."""
    if origin[2] <= 0:
        return origin, ()
    return -origin, noted(
        Kind.PLATES, "FORCE_PLATFORM:ORIGIN has the sign of another convention and is reversed"
    )


def _already_calibrated(
    scales: Float[np.ndarray, " channels"], calibration: Float[np.ndarray, "6 6"]
) -> bool:
    """Whether the scales are the calibration's diagonal times one number, forces and moments apart."""
    diagonal, scales = np.abs(np.diag(calibration)), np.abs(scales)
    alike = np.ptp(scales[:3]) <= CALIBRATED_SPREAD * scales[:3].max()
    if alike or not diagonal.all() or not scales.all():
        return False
    ratio = (scales / diagonal).reshape(2, 3)
    return bool(np.all(np.ptp(ratio, axis=1) <= CALIBRATED_SPREAD * ratio.min(axis=1)))


def _with_likely_unit(
    plate: PlatformSignals,
    wrench: Callable[[float], Wrench],
    declared: float,
    *,
    units: Mapping[str, float],
    what: str,
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """The wrench under the declared unit, unless another one fits the plate better.

    A factor of a thousand too much puts the centres of pressure off the plate, one too little puts them all
    into its very middle: right is the largest unit that leaves them on the plate.
    """
    force, moment = wrench(declared)
    inside = _share_inside(plate, force, moment)
    if inside is None:
        return force, moment, ()
    for factor in sorted({declared, *units.values()}, reverse=True):
        other = wrench(factor)
        if (_share_inside(plate, *other) or 0.0) < INSIDE_SHARE:
            continue
        if factor == declared:
            return force, moment, ()
        vertical = np.maximum(np.abs(force[:, 2]), JUDGED_N)
        reach = np.linalg.norm(other[1] - wrench(0.0)[1], axis=1) / vertical
        if np.nanmedian(reach[vertical > JUDGED_N]) > MIDDLE_M:
            name = next(name for name, metres in units.items() if metres == factor)
            return *other, noted(
                Kind.OTHER, f"{what} read as {name}: only then do they fit the size of the plate"
            )
    if inside >= INSIDE_SHARE:
        return force, moment, ()
    few = f"only {inside:.0%} of the centres of pressure under load lie on the plate"
    return force, moment, noted(Kind.OTHER, few)


def _share_inside(
    plate: PlatformSignals, force: Float[np.ndarray, "samples 3"], moment: Float[np.ndarray, "samples 3"]
) -> float | None:
    """Share of loaded samples whose centre of pressure lies on the plate; None where too few are loaded."""
    vertical = np.nan_to_num(np.abs(force[:, 2]))
    loaded = vertical > max(JUDGED_N, UNTARED_SHARE * float(vertical.max(initial=0.0)))
    if loaded.sum() < FEWEST_JUDGED:
        return None
    centre = np.abs(moment[loaded][:, [1, 0]]) / vertical[loaded, None]
    return float(np.mean(np.all(centre <= INSIDE_MARGIN * plate.half_sides, axis=1)))


def _word(unit: str) -> str:
    """A unit's letters: "N.mm", "N*mm" and "N-mm" are "nmm"."""
    return "".join(letter for letter in unit.lower() if letter.isalpha())


@dataclass(frozen=True)
class Platform:
    """One platform in the laboratory's axes, force signs as in the file."""

    name: str
    force_lab: Float[np.ndarray, "samples 3"]  # [N]
    moment_lab: Float[np.ndarray, "samples 3"]  # [N·m] about the laboratory's origin
    corners_lab: Float[np.ndarray, "4 3"]  # [m]


def force_platforms(contents: C3dContents, metres: float) -> tuple[tuple[Platform, ...], tuple[Note, ...]]:
    """Wrenches of all usable platforms, and what was assumed or left out.

    Args:
        contents: the file.
        metres: per POINT:UNITS, in which corners and origins are given.

    Raises:
        CaptureError: a platform is of a type other than 1 to 4.
    """
    used = int(contents.number("FORCE_PLATFORM", "USED", 0))
    source = contents.path.name
    if used and not contents.analogs.size:
        return (), noted(
            Kind.LEFT_OUT,
            f"{source}: {used} force plates declared, but the file holds no analog samples: no forces",
        )
    types = contents.array("FORCE_PLATFORM", "TYPE").ravel().astype(int)[:used]
    _refuse_unknown_types(contents, types)
    platforms: list[Platform] = []
    remarks: dict[Note, list[int]] = {}
    for k in range(used):
        corners = _of_plate(contents.array("FORCE_PLATFORM", "CORNERS"), k, 2).T * metres
        flaw = _flaw(contents, k, types, corners)
        if flaw:
            remarks.setdefault(Note(Kind.PLATES, f"left out: {flaw}"), []).append(k + 1)
            continue
        signals, zero_notes = _zeroed(contents, _signals(contents, k, int(types[k]), corners, metres))
        force, moment, wrench_notes = wrench_on_surface(signals)
        R_lab_plate = plate_axes(corners)
        force_lab = force @ R_lab_plate.T
        moment_lab = moment @ R_lab_plate.T + np.cross(corners.mean(axis=0), force_lab)
        platforms.append(Platform(f"plate {k + 1}", force_lab, moment_lab, corners))
        for remark in zero_notes + wrench_notes:
            remarks.setdefault(remark, []).append(k + 1)
    return tuple(platforms), tuple(
        remark.of(f"{source}: plate {', '.join(map(str, plates))}") for remark, plates in remarks.items()
    )


def plate_axes(corners: Float[np.ndarray, "4 3"]) -> Float[np.ndarray, "3 3"]:
    """R_lab_plate: the plate's axes as columns, from its corners."""
    x = corners[0] - corners[1]
    z = np.cross(x, corners[0] - corners[3])
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    return axes / np.linalg.norm(axes, axis=0)


def _refuse_unknown_types(contents: C3dContents, types: np.ndarray) -> None:
    unknown = sorted({int(kind) for kind in types if kind not in CHANNELS_OF_TYPE})
    if unknown:
        which = ", ".join(f"plate {k + 1}" for k, kind in enumerate(types) if kind in unknown)
        raise CaptureError(
            f"{contents.path}: {which}: force platforms of type {', '.join(map(str, unknown))} cannot be "
            "read, only types 1 to 4. Export the forces as .mot and name that file as the trial's `forces` "
            "in subject.toml."
        )


def _flaw(contents: C3dContents, k: int, types: np.ndarray, corners: np.ndarray) -> str | None:
    """Why plate k cannot be used, or None."""
    if k >= len(types):
        return "FORCE_PLATFORM:TYPE doesn't mention it"
    count, held = CHANNELS_OF_TYPE[int(types[k])], contents.analogs.shape[1]
    channels = _channels(contents, k, count)
    if len(channels) < count:
        return f"FORCE_PLATFORM:CHANNEL doesn't name its {count} channels"
    missing = [str(channel) for channel in channels if not 1 <= channel <= held]
    if missing:
        return f"its analog channels {', '.join(missing)} are not in the file, which holds {held}"
    if corners.shape != (4, 3):
        return "FORCE_PLATFORM:CORNERS doesn't give its corners"
    low, high = SHORTEST_SIDE_M, LONGEST_SIDE_M
    near = np.abs(corners) < FARTHEST_CORNER_M
    sides = np.linalg.norm(np.where(near, corners - np.roll(corners, 1, axis=0), np.inf), axis=1)
    area = np.linalg.norm(np.cross(corners[0] - corners[1], corners[0] - corners[3])) if near.all() else 0.0
    if not (np.all((sides > low) & (sides < high)) and area > low**2):
        return "its FORCE_PLATFORM:CORNERS don't describe a plate"
    return None


def _channels(contents: C3dContents, k: int, count: int) -> np.ndarray:
    return _of_plate(contents.array("FORCE_PLATFORM", "CHANNEL"), k, 1).astype(int)[:count]


def _signals(contents: C3dContents, k: int, kind: int, corners: np.ndarray, metres: float) -> PlatformSignals:
    channels = _channels(contents, k, CHANNELS_OF_TYPE[kind]) - 1
    units, scales = contents.words("ANALOG", "UNITS"), contents.array("ANALOG", "SCALE").ravel()
    origin = _of_plate(contents.array("FORCE_PLATFORM", "ORIGIN"), k, 1)
    calibration = _of_plate(contents.array("FORCE_PLATFORM", "CAL_MATRIX"), k, 2)
    polynomial = _of_plate(contents.array("FORCE_PLATFORM", "FPCOPPOLY"), k, 2).T.ravel()
    return PlatformSignals(
        kind=kind,
        signals=contents.analogs[:, channels],
        units=tuple(units[c] if c < len(units) else "" for c in channels),
        scales=np.array([scales[c] if c < len(scales) else 1.0 for c in channels]),
        metres=metres,
        origin=origin * metres if origin.shape == (3,) else np.zeros(3),
        half_sides=0.5 * np.linalg.norm(corners[0] - corners[[1, 3]], axis=1),
        calibration=calibration if calibration.shape == (6, 6) and calibration.any() else None,
        cop_polynomial=polynomial if polynomial.shape == (12,) else None,
    )


def _of_plate(parameter: np.ndarray, k: int, dimensions: int) -> np.ndarray:
    """The k-th plate's part of a parameter whose last dimension counts plates; empty where it has none."""
    if parameter.ndim == dimensions:
        parameter = parameter[..., None]
    if parameter.ndim != dimensions + 1 or k >= parameter.shape[-1]:
        return np.zeros((0,) * dimensions)
    return parameter[..., k]


def _zeroed(contents: C3dContents, plate: PlatformSignals) -> tuple[PlatformSignals, tuple[Note, ...]]:
    """The signals less their mean over the frames that FORCE_PLATFORM:ZERO names, if nobody stood there."""
    zero = contents.array("FORCE_PLATFORM", "ZERO").ravel().astype(int)
    if len(zero) < 2 or not 1 <= zero[0] <= zero[1] <= len(contents.points):
        return plate, ()
    samples = slice((zero[0] - 1) * contents.samples_per_frame, zero[1] * contents.samples_per_frame)
    baseline = np.nan_to_num(plate.signals[samples].mean(axis=0))
    if plate.kind == 1:
        baseline[3:5] = 0.0  # centres of pressure don't drift
    if not baseline.any():
        return plate, ()
    force = wrench_on_surface(replace(plate, signals=baseline[None]))[0]
    vertical, frames = abs(float(force[0, 2])), f"frames {zero[0]} to {zero[1]} (FORCE_PLATFORM:ZERO)"
    if vertical > ZERO_LIMIT_N:
        return plate, noted(Kind.PLATES, f"not zeroed: it carries {vertical:.0f} N on {frames}")
    return replace(plate, signals=plate.signals - baseline), noted(
        Kind.PLATES, f"zeroed by its mean on {frames}, {vertical:.1f} N"
    )
