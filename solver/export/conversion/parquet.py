"""A trial as Parquet: a row a frame, and in a second table a row a sample of the force plates.

STEM.parquet holds markers, coordinates and torques; STEM_forces.parquet the plates, STEM_forces_2.parquet
those of another clock, STEM_analog.parquet other analog channels. Each table says in its metadata what its
columns are, so that it can be read again.
"""

import json
from collections.abc import Sequence
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float

from solver.capture.capture import ForcePlate, Markers
from solver.capture.formats.analog_channels import AnalogChannels
from solver.common.errors import CaptureError
from solver.export.conversion.file_content import Content, Trial
from solver.export.conversion.opensim_set import by_clock
from solver.export.trial_table import UNITS

ABOUT = b"addb-viewer"  # key of the metadata
FORCES, ANALOG = "_forces", "_analog"
KINDS = (("force", "N"), ("moment", "Nm"), ("cop", "m"))


def write_parquet(content: Content, path: Path) -> tuple[str, ...]:
    """Write one trial.

    Raises:
        CaptureError: markers and motion do not share their frames.
    """
    (trial,) = content.trials
    columns, about = _frames(trial, content, path)
    if columns:
        _write(path, columns, about)
    for number, plates in enumerate(by_clock(trial.plates)):
        _write_plates(
            path.with_name(f"{path.stem}{FORCES}{f'_{number + 1}' if number else ''}.parquet"), plates
        )
    if trial.analog is not None:
        analog = trial.analog
        about = {"channels": analog.names, "units": analog.units}
        about |= {"rate_Hz": analog.rate, "start_time_s": analog.start_time}
        _write(path.with_name(f"{path.stem}{ANALOG}.parquet"), analog.columns, about)
    return ()


def read_parquet(path: Path) -> Content:
    """Read a trial that `write_parquet` wrote: its markers and plates.

    Raises:
        CaptureError: the file is no such table.
    """
    if path.stem.endswith(FORCES):
        return Content(path, (Trial(path.stem.removesuffix(FORCES), plates=tuple(_read_plates(path))),))
    table, about = _read(path)
    markers, left = None, []
    if about["markers"]:
        values = [_triple(table, name, "m") for name in about["markers"]]
        positions = np.stack(values, axis=1)
        markers = Markers(tuple(about["markers"]), positions, about["rate_Hz"], about["start_time_s"])
    if about["coordinates"]:
        left.append(f"{len(about['coordinates'])} coordinates, whose model is not in the table")
    others = sorted(path.parent.glob(f"{escape(path.stem)}{FORCES}*.parquet"))
    plates = tuple(plate for file in others for plate in _read_plates(file))
    analog = path.with_name(f"{path.stem}{ANALOG}.parquet")
    channels = _read_analog(analog) if analog.is_file() else None
    return Content(path, (Trial(path.stem, markers, plates, analog=channels),), left_behind=tuple(left))


def _frames(trial: Trial, content: Content, path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The columns that have a row a frame, and what is said about them."""
    clocks = [each for each in (trial.markers, trial.motion) if each is not None]
    if not clocks:
        return {}, {}
    first = clocks[0]
    if any(each.frames != first.frames or abs(each.rate - first.rate) > 1e-6 * first.rate for each in clocks):
        raise CaptureError(f"{path}: the trial's markers and motion have other frames; convert one of them.")
    columns: dict[str, np.ndarray] = {"time_s": first.times}
    names = trial.markers.names if trial.markers else ()
    for k, name in enumerate(names):
        assert trial.markers is not None
        columns |= _vector(name, "m", trial.markers.positions_ground[:, k])
    if trial.motion is not None and content.skeleton is not None:
        for k, coordinate in enumerate(content.skeleton.free_coordinates):
            angle, torque = UNITS[coordinate.motion]
            columns[f"{coordinate.name}_{angle}"] = trial.motion.q[:, k]
            if trial.torques is not None:
                columns[f"{coordinate.name}_{torque}"] = trial.torques[:, k]
    about = {
        "markers": list(names),
        "coordinates": list(trial.motion.dofs) if trial.motion else [],
        "rate_Hz": first.rate,
        "start_time_s": first.start_time,
    }
    return columns, about


def _write_plates(path: Path, plates: Sequence[ForcePlate]) -> None:
    columns: dict[str, np.ndarray] = {"time_s": plates[0].times}
    for plate in plates:
        series = (plate.force_ground, plate.moment_ground, plate.cop_ground)
        for (kind, unit), values in zip(KINDS, series, strict=True):
            columns |= _vector(f"{plate.name}_{kind}", unit, values)
    corners = [None if plate.corners_ground is None else plate.corners_ground.tolist() for plate in plates]
    about = {
        "plates": [plate.name for plate in plates],
        "corners_m": corners,
        "rate_Hz": plates[0].rate,
        "start_time_s": plates[0].start_time,
    }
    _write(path, columns, about)


def _read_plates(path: Path) -> list[ForcePlate]:
    table, about = _read(path)
    plates = []
    for name, corners in zip(about["plates"], about["corners_m"], strict=True):
        force, moment, cop = (_triple(table, f"{name}_{kind}", unit) for kind, unit in KINDS)
        place = None if corners is None else np.array(corners)
        plates.append(ForcePlate(name, force, moment, cop, about["rate_Hz"], about["start_time_s"], place))
    return plates


def _read_analog(path: Path) -> AnalogChannels:
    table, about = _read(path)
    values = np.column_stack([column.to_numpy() for column in table.columns[1:]])
    names, units = tuple(about["channels"]), tuple(about["units"])
    return AnalogChannels(names, units, values, about["rate_Hz"], about["start_time_s"])


def _write(path: Path, columns: dict[str, np.ndarray], about: dict[str, Any]) -> None:
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    said = json.dumps(about, ensure_ascii=False).encode()
    pq.write_table(table.replace_schema_metadata({ABOUT: said}), path)


def _read(path: Path) -> tuple[pa.Table, dict[str, Any]]:
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise CaptureError(
            f"{path}: cannot be read as Parquet ({error}). Convert the recording that it was made of again."
        ) from error
    metadata = table.schema.metadata or {}
    if ABOUT not in metadata:
        raise CaptureError(
            f"{path}: is no table that `convert` wrote, so nobody knows which columns are markers. Convert "
            "the recording that it was made of."
        )
    return table, json.loads(metadata[ABOUT])


def _vector(name: str, unit: str, values: Float[np.ndarray, "rows 3"]) -> dict[str, np.ndarray]:
    return {f"{name}_{axis}_{unit}": values[:, k] for k, axis in enumerate("xyz")}


def _triple(table: pa.Table, name: str, unit: str) -> Float[np.ndarray, "rows 3"]:
    columns = [table.column(f"{name}_{axis}_{unit}").to_numpy().astype(float) for axis in "xyz"]
    return np.column_stack(columns)
