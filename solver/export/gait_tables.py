"""Gait of all trials as tables, a row an event and a row a cycle, and as JSON."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
from jaxtyping import Bool, Float

from solver.capture.atomic import made_folder, whole_file, write_whole
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.fitting.settings import from_dict
from solver.gait.cycles import Cycle
from solver.gait.settings import GAIT
from solver.gait.stride_curves import POINTS, StrideCurves, stride_curves
from solver.gait.trial_gait import Gait, gait_of, joint_power

FOLDER = "gait"  # of its own, where no trial's files are
Row = dict[str, str | float | None]
DEFINITIONS = {
    "event": "contact, foot-off: the foot's vertical force crosses 20 N (source force), else its sole's slip "
    "over the surface crosses a share of the pace (source feet)",
    "stride_length_m": "this heel's way over the surface from contact to its next contact",
    "step_length_m": "how far this heel, as it ends the cycle, is ahead of the other's at its last contact",
    "step_width_m": "the same two heels, across the stride",
    "cadence_per_min": "120 / stride time: steps a minute",
    "speed_m_s": "stride length / stride time",
    "stance_share": "contact to foot-off, of the stride time",
    "source": "Perry & Burnfield 2010, Gait Analysis; Whittle 2007, Gait Analysis: an Introduction",
}


EVENT_COLUMNS = ("trial", "time_s", "foot", "event", "source")
CYCLE_COLUMNS = (
    *("trial", "foot", "contact_s", "foot_off_s", "next_contact_s"),
    *("stride_length_m", "step_length_m", "step_width_m", "cadence_per_min", "speed_m_s", "stance_share"),
)
UNITS = {"rotation": ("rad", "moment_Nm"), "translation": ("m", "force_N")}
POWER = "power_W"
Place = tuple[str, str]  # trial and foot
Columns = dict[str, np.ndarray]
Frames = Float[np.ndarray, " frames"]
OfDofs = Float[np.ndarray, "frames dofs"]
Quantity = tuple[str, Frames, OfDofs, Bool[np.ndarray, " frames"] | None, OfDofs | None]


def gaits_of(fit: Fit) -> dict[str, Gait]:
    """By trial, of those that show a stance."""
    found = {trial.capture.name: trial_gait(fit, trial) for trial in fit.trials}
    return {name: gait for name, gait in found.items() if gait is not None}


def trial_gait(fit: Fit, trial: TrialFit) -> Gait | None:
    """Of one trial; None where it shows no stance.

    Args:
        fit: of the subject.
        trial: of the fit.
    """
    if "conditioning" not in fit.settings:
        return None
    gait = gait_of(trial, fit.skeleton, GAIT, from_dict(fit.settings).conditioning)
    return gait if gait is not None and gait.events else None


def event_rows(gaits: dict[str, Gait]) -> list[Row]:
    """A row an event, trial by trial in order of time."""
    return [
        {
            "trial": name,
            "time_s": event.time_s,
            "foot": gait.feet[event.foot],
            "event": str(event.kind),
            "source": str(event.source),
        }
        for name, gait in gaits.items()
        for event in gait.events
    ]


def cycle_rows(gaits: dict[str, Gait]) -> list[Row]:
    """A row a cycle, trial by trial in order of time."""
    return [
        {
            "trial": name,
            "foot": gait.feet[cycle.foot],
            "contact_s": cycle.start_s,
            "foot_off_s": cycle.off_s,
            "next_contact_s": cycle.end_s,
            "stride_length_m": cycle.stride_length_m,
            "step_length_m": cycle.step_length_m,
            "step_width_m": cycle.step_width_m,
            "cadence_per_min": cycle.cadence_per_min,
            "speed_m_s": cycle.speed_m_s,
            "stance_share": cycle.stance_share,
        }
        for name, gait in gaits.items()
        for cycle in gait.cycles
    ]


def export_gait(
    fit: Fit, folder: Path, suffix: str, write: Callable[[pa.Table, BinaryIO], object]
) -> list[Path]:
    """Write gait/events, gait/cycles, gait/curves and gait/gait.json; nothing where no trial shows a stance.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    gaits = gaits_of(fit)
    if not gaits:
        return []
    place, written = made_folder(folder / FOLDER), []
    tables: Sequence[tuple[str, list[Row]]] = (("events", event_rows(gaits)), ("cycles", cycle_rows(gaits)))
    for name, rows in tables:
        if rows:
            path = place / f"{name}{suffix}"
            with whole_file(path) as file:
                write(pa.Table.from_pylist(rows), file)
            written.append(path)
    curves = fit_curves(fit, gaits)
    if curves:
        path = place / f"curves{suffix}"
        with whole_file(path) as file:
            write(mean_table(curves), file)
        written.append(path)
    path = place / "gait.json"
    content = {"definitions": DEFINITIONS, **dict(tables)}
    write_whole(path, json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    return [*written, path]


@dataclass(frozen=True)
class CycledCurve:
    """One quantity over the strides of one foot in one trial."""

    trial: str
    foot: str
    column: str  # its name with the unit, without the side that the foot has
    curves: StrideCurves


def fit_curves(fit: Fit, gaits: dict[str, Gait]) -> list[CycledCurve]:
    """Coordinates, torques and powers of all trials; what has no side, over the strides of each foot.

    Args:
        fit: of the subject.
        gaits: of its trials.
    """
    found = []
    for trial in fit.trials:
        gait = gaits.get(trial.capture.name)
        for k, foot in enumerate(gait.feet if gait else ()):
            assert gait is not None
            cycles = [cycle for cycle in gait.cycles if cycle.foot == k]
            if cycles:
                found += list(_of_foot(fit, trial, foot, cycles))
    return found


def mean_table(found: Sequence[CycledCurve]) -> pa.Table:
    """A row a percent of each trial and foot: mean, standard deviations, number of strides."""

    def columns_of(place: Place) -> Columns:
        columns: Columns = {"percent": np.arange(POINTS)}
        for one in _at(found, place):
            nothing = np.full(POINTS, np.nan)
            columns[f"{one.column}_mean"] = nothing if one.curves.mean is None else one.curves.mean
            columns[f"{one.column}_sd"] = nothing if one.curves.std is None else one.curves.std
            if one.curves.within is not None:
                columns[f"{one.column}_within_sd"] = one.curves.within
            columns[f"{one.column}_strides"] = np.full(POINTS, len(one.curves.cycles))
        return columns

    return _stacked(found, columns_of)


def stride_table(found: Sequence[CycledCurve]) -> pa.Table:
    """A row a percent of each stride; no value where a stride is left out of a quantity."""

    def columns_of(place: Place) -> Columns:
        own = _at(found, place)
        starts = sorted({cycle for one in own for cycle in one.curves.cycles}, key=lambda c: c.start_s)
        columns: Columns = {
            "stride": np.repeat(np.arange(len(starts)) + 1, POINTS),
            "contact_s": np.repeat([c.start_s for c in starts], POINTS),
            "next_contact_s": np.repeat([c.end_s for c in starts], POINTS),
            "percent": np.tile(np.arange(POINTS), len(starts)),
        }
        for one in own:
            values = np.full((len(starts), POINTS), np.nan)
            values[[starts.index(cycle) for cycle in one.curves.cycles]] = one.curves.values
            columns[one.column] = values.ravel()
        return columns

    return _stacked(found, columns_of)


def _of_foot(fit: Fit, trial: TrialFit, foot: str, cycles: Sequence[Cycle]) -> Iterator[CycledCurve]:
    feet = trial.contacts.foot_bodies if trial.contacts else ()
    side, *others = [name.rpartition("_")[2] for name in sorted(feet, key=lambda name: name != foot)]
    for i, coordinate in enumerate(fit.skeleton.free_coordinates):
        stem, _, of = coordinate.name.rpartition("_")
        if of in others:
            continue
        name = stem if of == side else coordinate.name
        for unit, times, values, counts, std in _quantities(trial, UNITS[coordinate.motion]):
            of_one = None if std is None else std[:, i]
            curves = stride_curves(cycles, times, values[:, i], counts, of_one)
            yield CycledCurve(trial.capture.name, foot, f"{name}_{unit}", curves)


def _quantities(trial: TrialFit, units: tuple[str, str]) -> Iterator[Quantity]:
    trial = without_guesses(trial)
    dynamics, power, std = trial.dynamics, joint_power(trial), trial.std
    if dynamics is None or power is None:
        yield units[0], trial.motion.times, trial.motion.q, None, None
        return
    times = dynamics.motion.times
    angle, torque, of_power = (std.angle, std.torque, std.power) if std else (None, None, None)
    yield units[0], times, dynamics.motion.q, None, angle
    yield units[1], times, dynamics.joint_torques, dynamics.used, torque
    yield POWER, times, power, dynamics.used, of_power


def _at(found: Sequence[CycledCurve], place: Place) -> list[CycledCurve]:
    return [one for one in found if (one.trial, one.foot) == place]


def _stacked(found: Sequence[CycledCurve], columns_of: Callable[[Place], Columns]) -> pa.Table:
    tables = []
    for trial, foot in dict.fromkeys((one.trial, one.foot) for one in found):
        columns = columns_of((trial, foot))
        rows = len(next(iter(columns.values())))
        named = {"trial": pa.array([trial] * rows), "foot": pa.array([foot] * rows)}
        tables.append(pa.table(named | {k: pa.array(v, from_pandas=True) for k, v in columns.items()}))
    return pa.concat_tables(tables, promote_options="permissive") if tables else pa.table({})
