"""Force platforms of a C3D file, as wrenches about the laboratory's origin.

The plate frame follows from the corners, which are numbered by the quadrants of the plate's own x-y plane: x
runs from corner 2 to 1, y from corner 4 to 1, z = x × y (downwards on plates that keep to the specification).
Source: The C3D File Format User Guide (Motion Lab Systems 2008), FORCE_PLATFORM group.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.capture.formats.c3d_contents import C3dContents
from solver.capture.plates.platform_wrench import (
    PLATFORM_UNITS,
    PlatformSignals,
    PlatformUnitSettings,
    wrench_on_surface,
)
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import CONTACT_N
from solver.common.settings_field import setting

CHANNELS_OF_TYPE = {1: 6, 2: 6, 3: 8, 4: 6}


@dataclass(frozen=True)
class ForcePlatformSettings:
    """How platforms are checked."""

    zero_limit_N: float = setting(
        50.0, unit="N", why="more than drift: on the FORCE_PLATFORM:ZERO frames somebody stood there"
    )
    centre_known_N: float = setting(
        CONTACT_N, unit="N", why="below it centres of pressure are noise and are not reported"
    )
    shortest_side_m: float = setting(0.1, unit="m", why="corners nearer to each other are garbage")
    longest_side_m: float = setting(6.0, unit="m", why="belts are shorter; corners farther apart are garbage")
    farthest_m: float = setting(100.0, unit="m", why="corners farther from the origin are garbage")


@dataclass(frozen=True)
class Platform:
    """One platform in the laboratory's axes, force signs as in the file."""

    name: str
    force_lab: Float[np.ndarray, "samples 3"]  # [N]
    moment_lab: Float[np.ndarray, "samples 3"]  # [N·m] about the laboratory's origin
    corners_lab: Float[np.ndarray, "4 3"]  # [m]


def force_platforms(
    contents: C3dContents,
    metres: float,
    settings: ForcePlatformSettings = ForcePlatformSettings(),
    unit_settings: PlatformUnitSettings = PLATFORM_UNITS,
) -> tuple[tuple[Platform, ...], tuple[Note, ...]]:
    """Wrenches of all usable platforms, and what was assumed or left out.

    Args:
        contents: the file.
        metres: per POINT:UNITS, in which corners and origins are given.
        settings: how they are checked.
        unit_settings: how units of their moments are.

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
        flaw = _flaw(contents, k, types, corners, settings)
        if flaw:
            remarks.setdefault(Note(Kind.PLATES, f"left out: {flaw}"), []).append(k + 1)
            continue
        signals, zero_notes = _zeroed(
            contents, _signals(contents, k, int(types[k]), corners, metres), settings, unit_settings
        )
        force, moment, wrench_notes = wrench_on_surface(signals, unit_settings)
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


def _flaw(
    contents: C3dContents, k: int, types: np.ndarray, corners: np.ndarray, settings: ForcePlatformSettings
) -> str | None:
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
    low, high = settings.shortest_side_m, settings.longest_side_m
    near = np.abs(corners) < settings.farthest_m
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


def _zeroed(
    contents: C3dContents,
    plate: PlatformSignals,
    settings: ForcePlatformSettings,
    unit_settings: PlatformUnitSettings,
) -> tuple[PlatformSignals, tuple[Note, ...]]:
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
    force = wrench_on_surface(replace(plate, signals=baseline[None]), unit_settings)[0]
    vertical, frames = abs(float(force[0, 2])), f"frames {zero[0]} to {zero[1]} (FORCE_PLATFORM:ZERO)"
    if vertical > settings.zero_limit_N:
        return plate, noted(Kind.PLATES, f"not zeroed: it carries {vertical:.0f} N on {frames}")
    return replace(plate, signals=plate.signals - baseline), noted(
        Kind.PLATES, f"zeroed by its mean on {frames}, {vertical:.1f} N"
    )
