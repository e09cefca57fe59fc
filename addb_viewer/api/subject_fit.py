"""A subject, fitted: its figures, its trials, and what can be made of them."""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from addb_viewer.api.cycle_curves import RESTS_ON_FORCES, CycleCurves, curves, foot_of
from addb_viewer.api.fitted_trial import FittedTrial
from addb_viewer.api.labelled import Table, UnknownNameError, read_only
from addb_viewer.jobs.accepted_extension import extension_of
from solver.common.notes import Note
from solver.common.typed_json import plain
from solver.export.gait_tables import CYCLE_COLUMNS, EVENT_COLUMNS, cycle_rows, event_rows, gaits_of
from solver.fitting.fit_summary import FitSummary
from solver.fitting.settings import from_dict
from solver.fitting.summary import all_notes, summary

SERIES = ("coordinates", "velocities", "accelerations", *RESTS_ON_FORCES, "com")

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

    from solver.fitting.fit_result import Fit as SolvedFit


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """One skeleton for the subject and, for every trial, motion, torques and residuals: `fit["walk"]`."""

    solved: "SolvedFit"  # as the solver gives it
    results: Path  # the folder that it is kept in
    new: bool = True  # False: nothing had changed, so the kept fit stands
    _keeps: object = field(default=None)  # what must live as long: a temporary folder

    def __repr__(self) -> str:
        """Whose fit, and of how many trials."""
        trials = ", ".join(self.trials)
        return f"<Fit of {self.solved.subject.name}: {self.mass_kg:.1f} kg, {self.height_m:.2f} m; {trials}>"

    def __str__(self) -> str:
        """The summary table, and what needs a decision: what `addb-viewer fit` prints."""
        from addb_viewer.text.summary_table import summary_text  # noqa: PLC0415 (draws tables; few ask)

        return summary_text(self._summary)

    @property
    def trials(self) -> tuple[str, ...]:
        """Names of the trials."""
        return tuple(trial.capture.name for trial in self.solved.trials)

    def __getitem__(self, trial: str | int) -> FittedTrial:
        """One trial by its name, or by its place in `trials`."""
        if isinstance(trial, int):
            trial = self.trials[trial]
        if trial not in self.trials:
            raise UnknownNameError(trial, self.trials, "trial")
        return self._fitted[trial]

    def __iter__(self) -> Iterator[FittedTrial]:
        """The trials, in order."""
        return iter(self._fitted.values())

    def __len__(self) -> int:
        """Number of trials."""
        return len(self.solved.trials)

    @property
    def mass_kg(self) -> float:
        """Fitted mass [kg]."""
        return self.solved.mass_kg

    @property
    def mass_std_kg(self) -> float:
        """How far it may be off: standard deviation [kg]; NaN where no force tells it."""
        return self.solved.mass_std.body_kg if self.solved.mass_std else math.nan

    @property
    def height_m(self) -> float:
        """Height that residuals are scaled with [m]."""
        return self.solved.height_m

    @cached_property
    def _summary(self) -> FitSummary:
        """How good the fit is, typed."""
        return summary(self.solved)

    @cached_property
    def figures(self) -> Mapping[str, Any]:
        """How good the fit is, in the shape of `addb-viewer fit --json`; None where not computed."""
        return plain(self._summary)

    @cached_property
    def notes(self) -> tuple[Note, ...]:
        """What was assumed, converted or ignored."""
        return all_notes(self.solved)

    @cached_property
    def bodies(self) -> Table:
        """The skeleton's bodies: name, mass and how far it may be off [kg], centre of mass in its frame [m].

        `mass_std_untold_kg` is how far it might be off had this recording told nothing of it; NaN where no
        force tells masses.
        """
        bodies, off = self.solved.skeleton.bodies, self.solved.mass_std
        unknown = np.full(len(bodies), np.nan)
        centres = np.array([body.com_body for body in bodies])
        return Table(
            {
                "body": np.array([body.name for body in bodies], dtype=object),
                "mass_kg": np.array([body.mass for body in bodies]),
                "mass_std_kg": unknown if off is None else off.segments_kg,
                "mass_std_untold_kg": unknown if off is None else off.untold_kg,
                **{f"com_{axis}_m": centres[:, a] for a, axis in enumerate("xyz")},
            }
        )

    @cached_property
    def stance_influence(self) -> Table:
        """Whole stances with known forces, and the torque elsewhere that rests on each most; a row a stance.

        trial, foot, start, end [frames of the trial]; coordinate, frame, `change` [N·m, N] of its torque if
        the stance's forces had not been seen, and the torque's `std`. Worked out when it is asked for.

        Raises:
            SolverError: the causes that the fit took as accepted are kept no longer.
        """
        from solver.fitting.held_out_stage import leave_stances_out  # noqa: PLC0415 (slow to load; few ask)

        solved = self.solved
        extension = extension_of(solved, self.results)
        found = list(leave_stances_out(solved, from_dict(solved.settings), extension))
        texts = {"trial": [f.trial for f in found], "foot": [f.foot for f in found]}
        return Table(
            {
                **{name: np.array(values, dtype=object) for name, values in texts.items()},
                "start": np.array([f.frames[0] for f in found], dtype=int),
                "end": np.array([f.frames[1] for f in found], dtype=int),
                "coordinate": np.array([f.dof for f in found], dtype=object),
                "frame": np.array([f.at_frame for f in found], dtype=int),
                "change": np.array([f.change for f in found], dtype=float),
                "std": np.array([f.std for f in found], dtype=float),
            }
        )

    def torque_covariance(self, trial: str, frame: int, names: Sequence[str] = ()) -> np.ndarray:
        """How errors of one frame's torques go together: joint covariance [N·m or N, squared].

        Its diagonal is `torques.std` squared; NaN where a torque has no band.

        Args:
            trial: its name.
            frame: of the trial, from 0.
            names: of coordinates, in the order wanted; all of `torques.names` if there are none.

        Raises:
            KeyError: no such trial or coordinate.
            SolverError: there are no bands or no such frame; or causes that the fit took are kept no longer.
        """
        from solver.fitting.torque_covariance import torque_covariance  # noqa: PLC0415 (few ask)

        solved, dofs = self.solved, self.solved.skeleton.dofs
        if trial not in self.trials:
            raise UnknownNameError(trial, self.trials, "trial")
        for name in names:
            if name not in dofs:
                raise UnknownNameError(name, dofs, "coordinate")
        rows, own = [dofs.index(name) for name in names or dofs], solved.trials[self.trials.index(trial)]
        settings, extension = from_dict(solved.settings), extension_of(solved, self.results)
        return read_only(torque_covariance(solved, own, frame, settings, extension)[np.ix_(rows, rows)])

    @cached_property
    def events(self) -> Table:
        """Contacts and foot-offs of all trials: trial, time_s, foot, event, source."""
        return _table(event_rows(self._gaits), EVENT_COLUMNS)

    @cached_property
    def cycles(self) -> Table:
        """Gait cycles of all trials, with stride length, speed, cadence and the like."""
        return _table(cycle_rows(self._gaits), CYCLE_COLUMNS)

    def by_cycle(
        self,
        series: str,
        name: str,
        *,
        foot: str | None = None,
        points: int = 101,
        measured_only: bool = True,
    ) -> CycleCurves:
        """A quantity over the gait cycles of all trials, each from 0 to 100 %.

        Args:
            series: "coordinates", "velocities", "accelerations", "torques", "powers" …, as of a trial.
            name: of the quantity in it, as "knee_angle_r".
            foot: whose contacts begin the cycles; None: that on the side in the name.
            points: of each curve, both ends included.
            measured_only: NaN where forces do not count, of what rests on forces; False: predictions as well.

        Raises:
            UnknownNameError: no such series, name, or foot.
        """
        if series not in SERIES:
            raise UnknownNameError(series, SERIES, "series")
        feet = self[0].feet if len(self) else ()
        wanted = foot_of(name, feet) if foot is None else foot
        if wanted not in feet:
            raise UnknownNameError(wanted, feet, "foot")
        found = [
            (self[trial], cycle)
            for trial, gait in self._gaits.items()
            for cycle in gait.cycles
            if gait.feet[cycle.foot] == wanted
        ]
        return curves(found, series, name, points=points, measured_only=measured_only)

    @cached_property
    def table(self) -> Table:
        """The tables of all trials below each other, with a column `trial`; NaN where a trial lacks one."""
        tables = [fitted.table for fitted in self]
        names = list(dict.fromkeys(name for table in tables for name in table.names))
        trial = [
            np.full(len(one), fitted.name, dtype=object) for one, fitted in zip(tables, self, strict=True)
        ]
        stacked = {"trial": np.concatenate(trial)}
        for name in names:
            known = next(table[name] for table in tables if name in table.names)
            stacked[name] = np.concatenate([_column(table, name, known) for table in tables])
        return Table(stacked)

    def to_polars(self) -> "pl.DataFrame":
        """`table` as a Polars frame."""
        return self.table.to_polars()

    def to_pandas(self) -> "pd.DataFrame":
        """`table` as a pandas frame."""
        return self.table.to_pandas()

    def export(self, to: str, folder: str | Path | None = None) -> list[Path]:
        """Write the fit for other tools.

        Args:
            to: "opensim", "b3d", "csv", "parquet", "gltf", "mujoco" or "c3d".
            folder: to write into; None: the results folder.

        Returns:
            The files written.

        Warns:
            UserWarning: what the format cannot hold, or what was changed for it.

        Raises:
            ValueError: no such format.
            SolverError: the folder cannot be written to.
        """
        from addb_viewer.jobs.exporting import Format, exported  # noqa: PLC0415 (loads all writers)

        if to not in list(Format):
            raise ValueError(f"no format '{to}'; choose {', '.join(Format)}")
        files, notes = exported(self.solved, Format(to), self.results if folder is None else Path(folder))
        for note in notes:
            warnings.warn(note, stacklevel=2)
        return files

    def report(self, file: str | Path | None = None, *, trials: Sequence[str] = ()) -> Path:
        """Write a page that says how good the fit is, on which frames, and why not on others.

        It shows the kept diagnosis where that is one of the same recordings, flags and settings.

        Args:
            file: to write; None: report.html in the results folder.
            trials: those to report; empty for all.

        Returns:
            The file.

        Raises:
            SolverError: it cannot be written.
        """
        from addb_viewer.report.reporting import PAGE, page_of  # noqa: PLC0415 (loads meshes and pictures)

        for name in trials:
            if name not in self.trials:
                raise UnknownNameError(name, self.trials, "trial")
        place = self.results / PAGE if file is None else Path(file)
        return page_of(self.solved, self.results, place, trials=trials)[0]

    @cached_property
    def _fitted(self) -> dict[str, FittedTrial]:
        return {t.capture.name: FittedTrial(t, self.solved.skeleton) for t in self.solved.trials}

    @cached_property
    def _gaits(self) -> dict[str, Any]:
        return gaits_of(self.solved)


def _table(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Table:
    """Rows as columns, which are there without a row as well; None as NaN among numbers."""
    return Table({name: _values([row[name] for row in rows]) for name in names})


def _values(values: Sequence[Any]) -> np.ndarray:
    if any(isinstance(value, str) for value in values):
        return np.array(values, dtype=object)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _column(table: Table, name: str, like: np.ndarray) -> np.ndarray:
    """A trial's column, or as many missing values."""
    if name in table.names:
        return table[name]
    missing: Any = {"f": np.nan, "O": "", "b": False}.get(like.dtype.kind, 0)
    return np.full(len(table), missing, dtype=like.dtype)
