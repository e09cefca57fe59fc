"""From a force platform's channels to force and moment at the middle of its surface, types 1 to 4.

Source: The C3D File Format User Guide (Motion Lab Systems 2008), FORCE_PLATFORM:TYPE; Kistler's eight-channel
formulae for type 3.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import FEWEST_JUDGED, JUDGED_N, UNTARED_SHARE
from solver.common.settings_field import setting

MOMENT_UNITS = {
    **dict.fromkeys(("nm", "ntm", "newtonmeter", "newtonmeters"), 1.0),
    **dict.fromkeys(("nmm", "ntmm", "newtonmillimeter", "newtonmillimeters"), 1e-3),
    **dict.fromkeys(("ncm", "ntcm"), 1e-2),
}
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}

Wrench = tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"]]


@dataclass(frozen=True)
class PlatformUnitSettings:
    """How units of moments and centres of pressure are checked: the latter must lie on the plate."""

    loaded_N: float = setting(JUDGED_N, unit="N", why="judged above: 5 N of noise are then 10 % of the force")
    loaded_share: float = setting(
        UNTARED_SHARE, unit="", why="of the largest force: an untared plate's offset is no load"
    )
    fewest_samples: int = setting(FEWEST_JUDGED, unit="", why="loaded samples that a judgement needs")
    inside_margin: float = setting(
        1.25, unit="", why="of half a side: room for drift of the signals and misplaced corners"
    )
    inside_share: float = setting(0.8, unit="", why="of loaded samples inside: confirms a unit")
    middle_m: float = setting(
        0.005,
        unit="m",
        why="feet press farther from the middle than that; levers a thousandth of theirs do not",
    )
    calibrated_spread: float = setting(
        0.03, unit="", why="ANALOG:SCALE over CAL_MATRIX agrees that well among channels"
    )


PLATFORM_UNITS = PlatformUnitSettings()


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
    plate: PlatformSignals, settings: PlatformUnitSettings = PLATFORM_UNITS
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """Force [N] and moment about the middle of the surface [N·m] in plate axes, as recorded; and notes."""
    if plate.kind == 1:
        return _centre_and_free_moment(plate, settings)
    if plate.kind == 3:
        return _eight_channels(plate)
    return _force_and_moment(plate, settings)


def _centre_and_free_moment(
    plate: PlatformSignals, settings: PlatformUnitSettings
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
        plate, wrench, declared, units={"m": 1.0, "mm": 1e-3}, what="centres of pressure", settings=settings
    )


def _force_and_moment(
    plate: PlatformSignals, settings: PlatformUnitSettings
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """Types 2 and 4: force and moment about the sensors' origin; type 4 through the calibration matrix."""
    channels = plate.signals
    notes: tuple[Note, ...] = ()
    if plate.kind == 4 and plate.calibration is not None:
        if _already_calibrated(plate.scales, plate.calibration, settings):
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
    force, moment, unit_notes = _with_likely_unit(
        plate, wrench, declared, units=units, what="moments", settings=settings
    )
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
        noted(Kind.OTHER, "centre of pressure corrected by FPCOPPOLY"),
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
    scales: Float[np.ndarray, " channels"],
    calibration: Float[np.ndarray, "6 6"],
    settings: PlatformUnitSettings,
) -> bool:
    """Whether the scales are the calibration's diagonal times one number, forces and moments apart."""
    diagonal, scales = np.abs(np.diag(calibration)), np.abs(scales)
    alike = np.ptp(scales[:3]) <= settings.calibrated_spread * scales[:3].max()
    if alike or not diagonal.all() or not scales.all():
        return False
    ratio = (scales / diagonal).reshape(2, 3)
    return bool(np.all(np.ptp(ratio, axis=1) <= settings.calibrated_spread * ratio.min(axis=1)))


def _with_likely_unit(
    plate: PlatformSignals,
    wrench: Callable[[float], Wrench],
    declared: float,
    *,
    units: Mapping[str, float],
    what: str,
    settings: PlatformUnitSettings,
) -> tuple[Float[np.ndarray, "samples 3"], Float[np.ndarray, "samples 3"], tuple[Note, ...]]:
    """The wrench under the declared unit, unless another one fits the plate better.

    A factor of a thousand too much puts the centres of pressure off the plate, one too little puts them all
    into its very middle: right is the largest unit that leaves them on the plate.
    """
    force, moment = wrench(declared)
    inside = _share_inside(plate, force, moment, settings)
    if inside is None:
        return force, moment, ()
    for factor in sorted({declared, *units.values()}, reverse=True):
        other = wrench(factor)
        if (_share_inside(plate, *other, settings) or 0.0) < settings.inside_share:
            continue
        if factor == declared:
            return force, moment, ()
        vertical = np.maximum(np.abs(force[:, 2]), settings.loaded_N)
        reach = np.linalg.norm(other[1] - wrench(0.0)[1], axis=1) / vertical
        if np.nanmedian(reach[vertical > settings.loaded_N]) > settings.middle_m:
            name = next(name for name, metres in units.items() if metres == factor)
            return *other, noted(
                Kind.OTHER, f"{what} read as {name}: only then do they fit the size of the plate"
            )
    if inside >= settings.inside_share:
        return force, moment, ()
    return (
        force,
        moment,
        noted(Kind.OTHER, f"only {inside:.0%} of the centres of pressure under load lie on the plate"),
    )


def _share_inside(
    plate: PlatformSignals,
    force: Float[np.ndarray, "samples 3"],
    moment: Float[np.ndarray, "samples 3"],
    settings: PlatformUnitSettings,
) -> float | None:
    """Share of loaded samples whose centre of pressure lies on the plate; None where too few are loaded."""
    vertical = np.nan_to_num(np.abs(force[:, 2]))
    loaded = vertical > max(settings.loaded_N, settings.loaded_share * float(vertical.max(initial=0.0)))
    if loaded.sum() < settings.fewest_samples:
        return None
    centre = np.abs(moment[loaded][:, [1, 0]]) / vertical[loaded, None]
    return float(np.mean(np.all(centre <= settings.inside_margin * plate.half_sides, axis=1)))


def _word(unit: str) -> str:
    """A unit's letters: "N.mm", "N*mm" and "N-mm" are "nmm"."""
    return "".join(letter for letter in unit.lower() if letter.isalpha())
