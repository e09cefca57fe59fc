"""Curves over the gait cycle as tables: mean and deviation at each percent, or every stride by itself."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from jaxtyping import Bool, Float

from solver.export.column_units import POWER, UNITS
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.gait.cycles import Cycle
from solver.gait.gait import Gait, joint_power
from solver.gait.stride_curves import POINTS, StrideCurves, stride_curves

Place = tuple[str, str]  # trial and foot
Columns = dict[str, np.ndarray]
Frames = Float[np.ndarray, " frames"]
Quantity = tuple[str, Frames, Float[np.ndarray, "frames dofs"], Bool[np.ndarray, " frames"] | None]


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
    """A row a percent of each trial and foot; mean, standard deviation of the sample, number of strides."""

    def told(place: Place) -> Columns:
        columns: Columns = {"percent": np.arange(POINTS)}
        for one in _at(found, place):
            nothing = np.full(POINTS, np.nan)
            columns[f"{one.column}_mean"] = nothing if one.curves.mean is None else one.curves.mean
            columns[f"{one.column}_sd"] = nothing if one.curves.std is None else one.curves.std
            columns[f"{one.column}_strides"] = np.full(POINTS, len(one.curves.cycles))
        return columns

    return _stacked(found, told)


def stride_table(found: Sequence[CycledCurve]) -> pa.Table:
    """A row a percent of each stride; no value where a stride is left out of a quantity."""

    def told(place: Place) -> Columns:
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

    return _stacked(found, told)


def _of_foot(fit: Fit, trial: TrialFit, foot: str, cycles: Sequence[Cycle]) -> Iterator[CycledCurve]:
    feet = trial.contacts.foot_bodies if trial.contacts else ()
    side, *others = [name.rpartition("_")[2] for name in sorted(feet, key=lambda name: name != foot)]
    for i, coordinate in enumerate(fit.skeleton.free_coordinates):
        stem, _, of = coordinate.name.rpartition("_")
        if of in others:
            continue
        name = stem if of == side else coordinate.name
        for unit, times, values, counts in _quantities(trial, UNITS[coordinate.motion]):
            curves = stride_curves(cycles, times, values[:, i], counts)
            yield CycledCurve(trial.capture.name, foot, f"{name}_{unit}", curves)


def _quantities(trial: TrialFit, units: tuple[str, str]) -> Iterator[Quantity]:
    trial = without_guesses(trial)
    dynamics, power = trial.dynamics, joint_power(trial)
    if dynamics is None or power is None:
        yield units[0], trial.motion.times, trial.motion.q, None
        return
    times = dynamics.motion.times
    yield units[0], times, dynamics.motion.q, None
    yield units[1], times, dynamics.joint_torques, dynamics.used
    yield POWER, times, power, dynamics.used


def _at(found: Sequence[CycledCurve], place: Place) -> list[CycledCurve]:
    return [one for one in found if (one.trial, one.foot) == place]


def _stacked(found: Sequence[CycledCurve], told: Callable[[Place], Columns]) -> pa.Table:
    tables = []
    for trial, foot in dict.fromkeys((one.trial, one.foot) for one in found):
        columns = told((trial, foot))
        rows = len(next(iter(columns.values())))
        named = {"trial": pa.array([trial] * rows), "foot": pa.array([foot] * rows)}
        tables.append(pa.table(named | {k: pa.array(v, from_pandas=True) for k, v in columns.items()}))
    return pa.concat_tables(tables, promote_options="permissive") if tables else pa.table({})
