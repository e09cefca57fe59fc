"""What the tab of curves shows, as CSV files: a column a quantity, with its unit at the name's end."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv

from addb_viewer.trial_view.by_cycle import CycledTrial
from addb_viewer.trial_view.charts import charts_of
from addb_viewer.trial_view.joint_quantities import PER_KG, JointQuantity, quantities_of
from addb_viewer.trial_view.replay import JointReplay, Replay
from solver.capture.atomic import whole_file
from solver.export.cycle_tables import CycledCurve, mean_table, stride_table
from solver.export.places import made

UNITS = {"°": "deg", "°/s": "deg_s", "m/s": "m_s", "N·m": "moment_Nm", "N": "force_N", "W": "power_W"}
CSV_OPTIONS = pa.csv.WriteOptions(quoting_style="needed")
Columns = dict[str, np.ndarray]


def write_over_time(replay: Replay, chosen: Sequence[str], file: Path, *, per_kg: bool = False) -> Path:
    """Write a row a frame of the recording, a cell without a number empty.

    Args:
        replay: the trial.
        chosen: ids of what is shown.
        file: to write; its folder is made.
        per_kg: torques and powers for each kilogram of the person.

    Raises:
        FitError, CaptureError: it cannot be written.
    """
    columns: Columns = {"frame": np.arange(replay.frames), "time_s": replay.times}
    if replay.residual is not None:
        columns["used"] = replay.residual.used
    for chart in charts_of(replay):
        if chart.title.lower() in chosen:
            lines = (line for line in chart.lines if line.is_own)
            columns |= {f"{_plain(chart.title, line.label)}_{chart.unit}": line.values for line in lines}
    if replay.joints is not None:
        columns |= _joint_columns(quantities_of(replay.joints, per_kg=per_kg), replay.joints, chosen)
    return _write(pa.table({k: pa.array(v, from_pandas=True) for k, v in columns.items()}), file)


def _joint_columns(
    quantities: Sequence[JointQuantity], joints: JointReplay, chosen: Sequence[str]
) -> Columns:
    """The chosen ones, each named by its coordinate in the model: knee_angle_r_moment_Nm."""
    return {
        f"{joints.names[column]}_{_unit(quantity)}": quantity.values(joints, column)
        for quantity in quantities
        if quantity.id in chosen
        for _, column in quantity.columns
    }


def write_by_cycle(trials: Sequence[CycledTrial], chosen: Sequence[str], file: Path) -> list[Path]:
    """Write mean and deviation at each percent, and beside them every stride; nothing without strides.

    Args:
        trials: that are shown.
        chosen: ids of what is shown.
        file: of the means; its folder is made.

    Raises:
        FitError, CaptureError: it cannot be written.
    """
    found = [curve for trial in trials for curve in _curves(trial, chosen)]
    if not found:
        return []
    single = file.with_name(f"{file.stem}_strides.csv")
    return [_write(mean_table(found), file), _write(stride_table(found), single)]


def _curves(trial: CycledTrial, chosen: Sequence[str]) -> Iterator[CycledCurve]:
    for quantity in trial.quantities().values():
        if quantity.id in chosen:
            for side, curves in trial.curves(quantity):
                if len(curves.cycles):
                    yield CycledCurve(trial.of.name, side, f"{quantity.stem}_{_unit(quantity)}", curves)


def _unit(quantity: JointQuantity) -> str:
    unit = quantity.unit.removesuffix(PER_KG)
    return UNITS.get(unit, unit) + ("_kg" if unit != quantity.unit else "")


def _plain(title: str, label: str) -> str:
    return re.sub(r"\W+", "_", f"{title} {label}".lower()).strip("_")


def _write(table: pa.Table, file: Path) -> Path:
    made(file.parent)
    with whole_file(file) as draft:
        pa.csv.write_csv(table, draft, CSV_OPTIONS)
    return file
