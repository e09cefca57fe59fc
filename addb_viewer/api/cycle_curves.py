"""Curves over the gait cycle: from 0 to 100 %, a row a cycle."""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.api.fitted_trial import FittedTrial
from addb_viewer.api.labelled import UnknownNameError
from solver.gait.cycles import Cycle
from solver.gait.stride_curves import stretch_to_stride

RESTS_ON_FORCES = ("torques", "powers", "forces", "moments", "residual_force", "residual_moment")


@dataclass(frozen=True, eq=False)
class CycleCurves:
    """One quantity over several gait cycles, each stretched to 0–100 %.

    Attributes:
        name: of the quantity.
        unit: of its values.
        percent: of the cycle; [points].
        values: a row a cycle; NaN where a quantity rests on forces that do not count; [cycles, points].
        trials: the trial of each cycle.
        start_s: when each begins, on its recording's clock [s].
    """

    name: str
    unit: str
    percent: Float[np.ndarray, " points"]
    values: Float[np.ndarray, "cycles points"]
    trials: tuple[str, ...]
    start_s: tuple[float, ...]

    def __len__(self) -> int:
        """Number of cycles."""
        return len(self.values)

    def __repr__(self) -> str:
        """What, and of how many cycles."""
        return f"<CycleCurves {self.name} [{self.unit}]: {len(self)} cycles × {len(self.percent)} points>"

    @property
    def mean(self) -> Float[np.ndarray, " points"]:
        """Over the cycles that have a value there; NaN where none has."""
        return _over_cycles(np.nanmean, self.values)

    @property
    def std(self) -> Float[np.ndarray, " points"]:
        """Standard deviation likewise, of the sample; NaN below two cycles."""
        return _over_cycles(lambda v, axis: np.nanstd(v, axis=axis, ddof=1), self.values)


def foot_of(name: str, feet: tuple[str, ...]) -> str:
    """The foot on the side that a name ends in: "knee_angle_r" goes with "calcn_r".

    Raises:
        UnknownNameError: the name ends in no foot's side.
    """
    side = name.rsplit("_", 1)[-1]
    own = [foot for foot in feet if "_" in foot and foot.rsplit("_", 1)[-1] == side]
    if len(own) != 1:
        raise UnknownNameError(name, feet, "foot for")
    return own[0]


def curves(
    cycles: Iterable[tuple[FittedTrial, Cycle]], series: str, name: str, *, points: int, measured_only: bool
) -> CycleCurves:
    """Stretch a quantity's cycles to one length, linearly between frames.

    Args:
        cycles: each with its trial.
        series: an attribute of `FittedTrial` that is a series.
        name: one of the series' names.
        points: from 0 to 100 %, both included.
        measured_only: leave out frames whose forces do not count, where the quantity rests on forces.
    """
    share = np.linspace(0.0, 1.0, points)
    rows, trials, starts, unit = [], [], [], ""
    for trial, cycle in cycles:
        of = getattr(trial, series)
        if not of.names:
            continue
        row = stretch_to_stride(cycle, trial.times, of[name], points)
        if measured_only and series in RESTS_ON_FORCES:
            times = cycle.start_s + share * (cycle.end_s - cycle.start_s)
            row[~_between_used(trial, times)] = np.nan
        unit = of.units[of.names.index(name)]
        rows.append(row)
        trials.append(trial.name)
        starts.append(cycle.start_s)
    values = np.array(rows).reshape(len(rows), points)
    return CycleCurves(name, unit, 100.0 * share, values, tuple(trials), tuple(starts))


def _between_used(trial: FittedTrial, times: Float[np.ndarray, " points"]) -> Bool[np.ndarray, " points"]:
    """Whether the frames on both sides count."""
    before = np.clip(np.searchsorted(trial.times, times, side="right") - 1, 0, trial.frames - 1)
    after = np.clip(np.searchsorted(trial.times, times, side="left"), 0, trial.frames - 1)
    return np.asarray(trial.used[before] & trial.used[after])


def _over_cycles(statistic, values: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    if not len(values):
        return np.full(values.shape[1], np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # points at which no cycle has a value
        return np.asarray(statistic(values, axis=0))
