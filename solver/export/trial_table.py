"""A trial as one table, a row a frame, the unit in each column's name: CSV or Parquet."""

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from jaxtyping import Float

from solver.capture.atomic import made_folder, whole_file
from solver.capture.formats.analog_channels import analog_or_why_not
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics, TrialStd
from solver.export.export_places import trial_stems
from solver.export.gait_tables import POWER, UNITS, export_gait
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.gait.trial_gait import joint_power
from solver.kinematics.angle_conventions import CONVENTIONS, angles_by_convention
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton

Columns = dict[str, np.ndarray]
CSV_OPTIONS = pa.csv.WriteOptions(quoting_style="needed")
WRITE: dict[str, Callable[[pa.Table, BinaryIO], object]] = {
    ".csv": lambda table, file: pa.csv.write_csv(table, file, CSV_OPTIONS),
    ".parquet": pa.parquet.write_table,
}


def export_csv(fit: Fit, folder: Path) -> list[Path]:
    """Write TRIAL.csv for every trial; numbers keep every digit, a cell without a number stays empty.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    return [
        *_tables(fit, folder, ".csv", trial_columns),
        *export_gait(fit, folder, ".csv", WRITE[".csv"]),
    ]


def export_parquet(fit: Fit, folder: Path) -> list[Path]:
    """Write TRIAL.parquet for every trial; a cell without a number is null.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    return [
        *_tables(fit, folder, ".parquet", trial_columns),
        *export_gait(fit, folder, ".parquet", WRITE[".parquet"]),
    ]


def export_angles(fit: Fit, folder: Path, suffix: str) -> list[Path]:
    """Write angles/TRIAL for every trial: joint angles [°] as OpenSim has them, and by other conventions.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    return _tables(fit, folder / "angles", suffix, angle_columns)


def angle_columns(trial: TrialFit, skeleton: Skeleton) -> Columns:
    """Joint angles of a trial [°], each convention's name before its own; NaN where there is none."""
    trial = without_guesses(trial)
    motion = trial.dynamics.motion if trial.dynamics else trial.motion
    columns = {"frame": np.arange(motion.frames), "time_s": motion.times}
    for i, coordinate in enumerate(skeleton.free_coordinates):
        if coordinate.motion == "rotation":
            columns[f"opensim_{coordinate.name}_deg"] = np.degrees(motion.q[:, i])
    for convention in CONVENTIONS:
        found = angles_by_convention(skeleton, motion.q, convention)
        columns |= {f"{convention}_{name}_deg": values for name, values in found.items()}
    return columns


def export_analog(fit: Fit, folder: Path, suffix: str) -> tuple[list[Path], tuple[str, ...]]:
    """Write analog/TRIAL of every trial with analog channels, a row a sample, on the recording's clock.

    Returns:
        The files, and which trials' recordings cannot be read any more.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    written, notes, stems = list[Path](), list[str](), trial_stems(fit)
    for trial in fit.trials:
        analog, why_not = analog_or_why_not(trial.capture.files)
        notes += (f"{trial.capture.name}: {why}" for why in why_not)
        if analog is not None:
            path = made_folder(folder / "analog") / f"{stems[trial.capture.name]}{suffix}"
            with whole_file(path) as file:
                WRITE[suffix](pa.table(analog.columns), file)
            written.append(path)
    return written, tuple(notes)


def trial_columns(trial: TrialFit, skeleton: Skeleton) -> Columns:
    """Everything about a trial that has one value a frame; NaN where there is none.

    The motion is the one that torques and residuals were computed on.
    """
    trial = without_guesses(trial)
    motion = trial.dynamics.motion if trial.dynamics else trial.motion
    columns = {"frame": np.arange(motion.frames), "time_s": motion.times}
    columns |= _of_motion(motion, skeleton)
    if trial.dynamics is not None:
        columns |= _of_dynamics(trial.dynamics, skeleton)
        columns |= _of_power(trial, skeleton)
        columns |= _of_predicted(trial)
    if trial.contacts is not None and trial.mask is not None:
        columns |= _of_contacts(trial.contacts, trial.mask)
    errors = trial.marker_errors
    columns |= {"marker_rms_m": errors.rms_per_frame, "marker_max_m": errors.maximum_per_frame}
    return columns if trial.std is None else columns | _of_std(trial.std, skeleton)


def _tables(
    fit: Fit, folder: Path, suffix: str, columns_of: Callable[[TrialFit, Skeleton], Columns]
) -> list[Path]:
    """TRIAL with these columns, of every trial."""
    written, stems = [], trial_stems(fit)
    for trial in fit.trials:
        path = made_folder(folder) / f"{stems[trial.capture.name]}{suffix}"
        columns = columns_of(trial, fit.skeleton)
        table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
        with whole_file(path) as file:
            WRITE[suffix](table, file)
        written.append(path)
    return written


def _of_motion(motion: Motion, skeleton: Skeleton) -> Columns:
    names = [f"{c.name}_{UNITS[c.motion][0]}" for c in skeleton.free_coordinates]
    columns: Columns = {}
    for values, per in ((motion.q, ""), (motion.velocity, "_s"), (motion.acceleration, "_s2")):
        columns |= {f"{name}{per}": values[:, i] for i, name in enumerate(names)}
    return columns


def _of_dynamics(dynamics: Dynamics, skeleton: Skeleton) -> Columns:
    names = [f"{c.name}_{UNITS[c.motion][1]}" for c in skeleton.free_coordinates]
    torques = {name: dynamics.joint_torques[:, i] for i, name in enumerate(names)}
    return {
        **torques,
        **_wrench("residual", dynamics.residual_root),
        **_wrench("residual_raw", dynamics.residual_raw_root),
        **_vector("root_joint", "m", dynamics.root_ground),
        **_vector("com", "m", dynamics.com_ground),
        "used": dynamics.used,
    }


def _of_power(trial: TrialFit, skeleton: Skeleton) -> Columns:
    power = joint_power(trial)
    names = [f"{c.name}_{POWER}" for c in skeleton.free_coordinates]
    return {} if power is None else {name: power[:, i] for i, name in enumerate(names)}


def _of_predicted(trial: TrialFit) -> Columns:
    """Where the torques rest on a foot's wrench that was predicted from the motion, and that wrench."""
    if trial.contacts is None or trial.dynamics is None:
        return {}
    is_predicted = trial.dynamics.wrench_is_predicted
    if is_predicted is None:
        is_predicted = np.zeros((trial.motion.frames, len(trial.contacts.foot_bodies)), dtype=bool)
    feet = trial.contacts.foot_bodies
    columns = {f"{foot}_predicted": is_predicted[:, f] for f, foot in enumerate(feet)}
    predicted = trial.dynamics.wrench_predicted_ground
    if predicted is not None:
        for f, foot in enumerate(feet):
            columns |= _wrench(f"{foot}_predicted", predicted[:, f])
    off = None if trial.std is None else trial.std.predicted_force_ground
    if off is not None:
        for f, foot in enumerate(feet):
            columns |= _vector(f"{foot}_predicted_force_std", "N", off[:, f])
    return columns


def _of_contacts(contacts: ContactWrenches, mask: FrameMask) -> Columns:
    columns: Columns = {}
    for f, foot in enumerate(contacts.foot_bodies):
        columns |= _wrench(foot, contacts.wrench_ground[:, f])
        columns |= _vector(f"{foot}_cop", "m", contacts.cop_ground[:, f])
        columns[f"{foot}_counts"] = mask.counts[:, f]
    return columns | {"missing_force": _reasons(mask)}


def _of_std(std: TrialStd, skeleton: Skeleton) -> Columns:
    """Standard deviations; as everywhere, a name ends with its unit."""
    columns: Columns = {}
    for i, c in enumerate(skeleton.free_coordinates):
        unit, (load, load_unit) = UNITS[c.motion][0], UNITS[c.motion][1].split("_")
        columns |= {
            f"{c.name}_std_{unit}": std.angle[:, i],
            f"{c.name}_std_{unit}_s": std.speed[:, i],
            f"{c.name}_std_{unit}_s2": std.acceleration[:, i],
            f"{c.name}_{load}_std_{load_unit}": std.torque[:, i],
            f"{c.name}_power_std_W": std.power[:, i],
        }
    return columns | {f"com_{axis}_std_m": std.com_ground[:, i] for i, axis in enumerate("xyz")}


def _wrench(name: str, wrench: Float[np.ndarray, "frames 6"]) -> Columns:
    return _vector(f"{name}_force", "N", wrench[:, :3]) | _vector(f"{name}_moment", "Nm", wrench[:, 3:])


def _vector(name: str, unit: str, values: Float[np.ndarray, "frames 3"]) -> Columns:
    return {f"{name}_{axis}_{unit}": values[:, i] for i, axis in enumerate("xyz")}


def _reasons(mask: FrameMask) -> np.ndarray:
    """Why a frame's force does not count; several reasons are joined, no reason is an empty text."""
    texts: list[list[str]] = [[] for _ in mask.counts]
    for start, end, foot, reason in mask.reasons:
        for frame in range(start, end):
            texts[frame].append(f"{foot}: {reason}" if foot else reason)
    return np.array(["; ".join(dict.fromkeys(text)) for text in texts], dtype=object)
