"""Markers and force plates as arrays: what goes in without files, and what a trial's files hold."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from addb_viewer.api.labelled import AXES, Series
from solver.capture.axes import vertical_axis, vertical_axis_named
from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.clock import JITTER
from solver.capture.formats.length_units import (
    LARGEST_PERSON_M,
    LARGEST_SPREAD_M,
    METRES_PER_UNIT,
    SMALLEST_PERSON_M,
    SMALLEST_SPREAD_M,
)
from solver.capture.marker_cleaning import unseen_as_nan
from solver.capture.plates.centre_of_pressure import LEVEL_GROUND, centre_of_pressure
from solver.capture.subject.subject_toml import can_name_a_trial
from solver.common.errors import CaptureError

LOADED_N = 20.0  # [N] below it a centre of pressure is noise: gait laboratories' contact threshold
PRESSED_N = 150.0  # [N] of a step; whoever stands on a plate reads more


@dataclass(frozen=True, eq=False)
class Plate:
    """One force plate: the force that the ground exerts on the person [N], in the markers' axes.

    Give the moment about the origin of these axes, or the centre of pressure, alone or with the free moment
    (the moment about the centre of pressure). Its clock may be faster than the markers'.
    """

    force: np.ndarray  # [samples, 3] [N]
    times: np.ndarray  # [samples] [s] on the markers' clock
    moment: np.ndarray | None = None  # [samples, 3] [N·m] about the origin
    centre_of_pressure: np.ndarray | None = None  # [samples, 3] [m] NaN while unloaded
    free_moment: np.ndarray | None = None  # [samples, 3] [N·m] about the centre of pressure


@dataclass(frozen=True, eq=False)
class Recording:
    """One trial as arrays: markers [m] and plates in one frame of reference, of which `up` points up."""

    markers: np.ndarray  # [frames, markers, 3] [m] NaN where not seen
    marker_names: Sequence[str]
    times: np.ndarray  # [frames] [s], uniform
    plates: Sequence[Plate] = ()
    up: str = "y"  # or "z", "x", "-x", ...: of markers and plates alike

    @property
    def series(self) -> Series:
        """The markers with names, unit and times."""
        names = tuple(self.marker_names)
        return Series(self.markers, names, ("m",) * len(names), self.times)


def recording_from(capture: Capture) -> Recording:
    """What the solver read from a trial's files: metres, newtons, y up, forces on the person."""
    markers = capture.markers
    plates = tuple(
        Plate(plate.force_ground, plate.times, plate.moment_ground, plate.cop_ground)
        for plate in capture.plates
    )
    return Recording(markers.positions_ground, markers.names, markers.times, plates)


def capture_from(name: str, recording: Recording, *, check: bool) -> Capture:
    """A trial as the solver takes it: y up.

    Args:
        name: of the trial, for messages.
        recording: as given.
        check: refuse what contradicts the stated units, axes or signs.

    Raises:
        CaptureError: shapes or times do not fit, or a check fails.
    """
    if not can_name_a_trial(name):
        raise CaptureError(f"trial '{name}': results are filed under that name; leave out / and \\.")
    positions = _array(recording.markers, (None, None, 3), f"{name}: markers", "[frames, markers, 3]")
    names = tuple(recording.marker_names)
    if len(names) != positions.shape[1]:
        raise CaptureError(
            f"{name}: {len(names)} marker_names for {positions.shape[1]} markers; give one a marker."
        )
    if len(set(names)) < len(names) or not all(isinstance(one, str) and one.strip() for one in names):
        raise CaptureError(f"{name}: marker_names must be texts, none empty, none twice.")
    rate, start = _clock(recording.times, len(positions), name)
    seen, notes = unseen_as_nan(positions, names, "markers")
    axis = vertical_axis_named(recording.up)
    R = axis.R_ground_lab
    markers = Markers(names, seen @ R.T, rate, start)
    plates = [
        _plate(one, f"{name}: plate {k}", R, f"ground_force_{k}")
        for k, one in enumerate(recording.plates, start=1)
    ]
    _check_one_clock(plates, name)
    if check:
        _check_size(seen, name)
        _check_up(recording, seen, name)
        for k, plate in enumerate(plates, start=1):
            _check_sign(plate, f"{name}: plate {k}")
    return Capture(name, markers, tuple(plates), notes)


def _array(values: Any, shape: tuple[int | None, ...], what: str, described: str) -> np.ndarray:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise CaptureError(f"{what}: not an array of numbers ({error}).") from error
    fits = array.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits or array.size == 0:
        raise CaptureError(f"{what}: shape {list(array.shape)}; {described} is needed.")
    if np.isinf(array).any():
        raise CaptureError(f"{what}: infinite values; write NaN where nothing was measured.")
    return array


def _clock(times: Any, count: int, what: str) -> tuple[float, float]:
    """Rate [Hz] and start [s] of uniform times."""
    t = _array(times, (count,), f"{what}: times", f"[{count}], one a row,")
    steps = np.diff(t)
    if not np.isfinite(t).all() or (count > 1 and not (steps > 0).all()):
        raise CaptureError(f"{what}: times must be finite and increase.")
    if count < 2:
        raise CaptureError(f"{what}: one row is no recording.")
    rate = (count - 1) / (t[-1] - t[0])
    off = float(np.max(np.abs(t - t[0] - np.arange(count) / rate)) * rate)
    if off > JITTER:
        raise CaptureError(
            f"{what}: times are not uniform; a row is {off:.2f} of a step away from a clock of {rate:.6g} "
            "Hz. Resample it, with NaN for markers in gaps."
        )
    return float(rate), float(t[0])


def _plate(plate: Plate, what: str, R: np.ndarray, name: str) -> ForcePlate:
    """The plate in the ground's axes, its moment about the origin."""
    force = _array(plate.force, (None, 3), f"{what}: force", "[samples, 3]")
    rate, start = _clock(plate.times, len(force), what)

    def rows(values: Any, said: str) -> np.ndarray:
        return _array(values, (len(force), 3), f"{what}: {said}", f"[{len(force)}, 3], as the force,")

    if plate.moment is not None and plate.free_moment is not None:
        raise CaptureError(f"{what}: moment is about the origin; give it or free_moment, not both.")
    point = plate.centre_of_pressure
    given = None if point is None else rows(point, "centre_of_pressure")
    if plate.moment is not None:
        moment = rows(plate.moment, "moment")
    elif given is not None:
        moment = np.cross(np.nan_to_num(given), force)
        moment += 0.0 if plate.free_moment is None else rows(plate.free_moment, "free_moment")
    else:
        raise CaptureError(f"{what}: give the moment about the origin, or the centre_of_pressure.")
    force, moment = force @ R.T, moment @ R.T
    if given is None:
        centre = centre_of_pressure(force, moment, LEVEL_GROUND)
        centre[~(force[:, 1] >= LOADED_N)] = np.nan
    else:
        centre = given @ R.T
    return ForcePlate(name, force, moment, centre, rate, start)


def _check_one_clock(plates: Sequence[ForcePlate], name: str) -> None:
    clocks = {(plate.samples, round(plate.rate, 6), round(plate.start_time, 6)) for plate in plates}
    if len(clocks) > 1:
        raise CaptureError(f"{name}: plates have different times; resample them to one clock.")


def _check_size(positions: np.ndarray, name: str) -> None:
    seen = positions[np.isfinite(positions).all(axis=2).sum(axis=1) >= 2]
    if not len(seen):
        return
    extent = float(np.median(np.linalg.norm(np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1), axis=1)))
    if SMALLEST_SPREAD_M <= extent <= LARGEST_SPREAD_M:
        return
    fitting = [
        unit
        for unit, metres in METRES_PER_UNIT.items()
        if SMALLEST_PERSON_M <= extent * metres <= LARGEST_PERSON_M
    ]
    hint = f" They look like {fitting[0]}: multiply by {METRES_PER_UNIT[fitting[0]]:g}." if fitting else ""
    raise CaptureError(f"{name}: the markers of a frame span {extent:.4g} m; metres are needed.{hint}")


def _check_up(recording: Recording, positions: np.ndarray, name: str) -> None:
    told = vertical_axis_named(recording.up)
    in_lab = Markers(tuple(recording.marker_names), positions, 1.0)
    forces = [np.nan_to_num(np.asarray(plate.force, dtype=float)) for plate in recording.plates]
    found = vertical_axis(in_lab, forces, default=AXES[told.axis])
    if found.certain and (found.axis, found.sign) != (told.axis, told.sign):
        raise CaptureError(
            f"{name}: up is '{recording.up}', but {found.name} points up ({'; '.join(found.evidence)}). Give "
            f'up="{found.name.removeprefix("+")}", or check=False if you are sure.'
        )


def _check_sign(plate: ForcePlate, what: str) -> None:
    vertical = plate.force_ground[:, 1]
    pressed = np.abs(vertical) > PRESSED_N
    if pressed.any() and np.median(vertical[pressed]) < 0:
        raise CaptureError(
            f"{what}: the force points down ({np.nanmin(vertical):.0f} N); give the force on the person, so "
            "multiply force and moment by −1. Or check=False if you are sure."
        )
