"""A subject's files of a release: fitted, put on the grid, cut, written."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from addb_viewer.accepted_extension import extension_for_solve
from addb_viewer.dataset.b3d_file import segments_of, subject_b3d
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.frame_rows import TrialRows, frames_table, kinematics_table
from addb_viewer.dataset.gridded_trial import GriddedTrial, on_grid
from addb_viewer.dataset.identifiers import file_name_of, side_of, without_names
from addb_viewer.dataset.left_out import LeftOut, hours_of
from addb_viewer.dataset.long_rows import joint_centres_table, markers_table, plates_table
from addb_viewer.dataset.named_causes import named_causes
from addb_viewer.dataset.parquet_files import write_parquet
from addb_viewer.dataset.receipts import MadeFile, Receipt, emptied, made_file
from addb_viewer.dataset.root_rows import (
    activity_rows,
    cause_rows,
    contact_rows,
    coordinate_rows,
    review_rows,
    segment_rows,
    subject_row,
    trial_row,
)
from addb_viewer.dataset.schema import SUBJECT_TABLES
from addb_viewer.dataset.segments import cuts_of
from addb_viewer.dataset.subject_task import Task
from addb_viewer.dataset.trial_labels import TrialLabels, labels_of
from addb_viewer.review_store import reviews_for_solve
from solver.capture.atomic import write_whole
from solver.capture.b3d.schema import B3dFile, B3dTrial
from solver.capture.subject import open_subject
from solver.dynamics.extension import Extension
from solver.export.b3d.from_fit import fit_to_b3d, unfitted
from solver.export.b3d.passes import LowPassed
from solver.export.b3d.writer import write_b3d
from solver.fit import Fit, TrialFit
from solver.pipeline import solve
from solver.results.store import default_folder
from solver.settings import Settings, as_toml, settings_for
from solver.skeleton.osim_writer import skeleton_text
from solver.summary import all_notes

MODEL_NAME = "subject"  # in model texts: the file's own may be a person's


def write_subject_files(task: Task) -> Receipt:
    """Solve the wanted trials together and write everything that the release has of the subject.

    Always from the beginning: a re-solve depends, within tolerance, on the edits before it.

    Raises:
        SolverError: the data cannot be fitted, or a file cannot be written.
        ReviewError: the reviews cannot be read.
    """
    settings = settings_for(task.place)
    subject = open_subject(task.place, settings.reading)
    chosen = [trial for trial in subject.trials if trial.name in task.trials]
    reviews, _ = reviews_for_solve(subject, chosen)
    extension, _ = extension_for_solve(subject, chosen, default_folder(subject.folder))
    fit = solve(subject, settings, trials=list(task.trials), reviews=reviews, extension=extension)
    fit, left = _fit_for_release(fit, task, settings)
    if not fit.trials:
        gone = LeftOut("subject", task.who.subject_id, "no_trials", "see its trials")
        return Receipt(task.key, left_out=(*left, gone))
    captures = [trial.capture for trial in fit.trials]
    kept = {capture.name for capture in captures}
    labels = labels_of(subject, [trial for trial in chosen if trial.name in kept], captures)
    return _Writing(task, fit, settings, extension, labels).receipt(left)


def _fit_for_release(fit: Fit, task: Task, settings: Settings) -> tuple[Fit, list[LeftOut]]:
    """The fit with those trials that a release takes, under names that tell nobody's; and the others."""
    kept, left = [], []
    for trial in fit.trials:
        reason, detail = _trial_gate(trial)
        if reason is None:
            kept.append(trial)
            continue
        name, frames = task.who.trial_id(trial.capture.name), trial.motion.frames
        hours = hours_of(frames, trial.motion.rate)
        left.append(LeftOut("trial", name, reason, detail, frames=frames, hours=hours))
    feet = {trial.contacts.foot_bodies for trial in kept if trial.contacts}
    if any(sorted(str(side_of(body)) for body in bodies) != ["l", "r"] for bodies in feet):
        raise ReleaseError(f"forces act on other than two feet: {', '.join(sorted(next(iter(feet))))}")
    named = replace(fit.skeleton, name=MODEL_NAME)
    unread = [
        LeftOut("trial", task.who.trial_id(one.name), "unreadable", one.file.reason)
        for one in fit.unread
        if one.name
    ]
    return replace(fit, skeleton=named, trials=tuple(kept)), [*left, *unread]


def _trial_gate(trial: TrialFit) -> tuple[str | None, str]:
    if not trial.forces_known.any():
        return "no_counting_frames", ""
    if trial.dynamics is None or trial.kinematics_only is None:
        return "no_dynamics", f"forces count on {int(trial.forces_known.sum())} frames"
    arrays = (trial.motion.q, trial.kinematics_only.motion.q, trial.dynamics.joint_torques)
    if not all(np.isfinite(array).all() for array in arrays):
        return "non_finite", ""
    return None, ""


class _Writing:
    """The files of one subject, trial after trial."""

    def __init__(
        self,
        task: Task,
        fit: Fit,
        settings: Settings,
        extension: Extension | None,
        labels: Mapping[str, TrialLabels],
    ) -> None:
        self.task, self.fit, self.settings, self.extension = task, fit, settings, extension
        self.labels = labels
        self.folder = emptied(task.out)
        self.stem = file_name_of(task.who.subject_id)
        bodies = next(trial.contacts.foot_bodies for trial in fit.trials if trial.contacts)
        self.sides = tuple(str(side_of(body)) for body in bodies)
        self.gridded = [on_grid(fit, trial, settings, task.options.rate_hz) for trial in fit.trials]
        self.gridded.sort(key=lambda one: task.who.trial_id(one.name))

    def receipt(self, left: Sequence[LeftOut]) -> Receipt:
        """Write everything; what was left out before is told with the rest."""
        b3d = self._b3d()
        rows = [self._rows(one, trial) for one, trial in zip(self.gridded, b3d.trials, strict=True)]
        files: dict[str, MadeFile] = {}
        starts: dict[str, dict[str, int]] = {one.trial_id: {} for one in rows}
        for table in SUBJECT_TABLES:
            path = table.file(self.stem)
            count = write_parquet(table, self._pieces(table.name, rows, b3d, starts), self._place(path))
            files[path] = made_file(self.folder / path, count)
        files |= dict(starmap(self._text, self._models()))
        path = f"b3d/{self.stem}.b3d"
        about = {one.name: self.labels[one.name] for one in self.gridded}
        whole = subject_b3d(b3d, self.task.who, self._notes(), segments_of(b3d, rows, about))
        write_b3d(whole, self._place(path))
        files[path] = made_file(self.folder / path)
        return Receipt(
            self.task.key,
            files=files,
            rows=self._root_rows(rows, starts),
            inputs=_inputs(self.fit.provenance),
            settings=as_toml(self.settings),
            left_out=(*left, *self._cut_away(rows)),
        )

    def _place(self, path: str) -> Path:
        place = self.folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        return place

    def _text(self, path: str, text: str) -> tuple[str, MadeFile]:
        write_whole(self._place(path), text)
        return path, made_file(self.folder / path)

    def _models(self) -> Iterator[tuple[str, str]]:
        yield f"models/{self.stem}.osim", skeleton_text(self.fit.skeleton)
        yield f"models/{self.stem}.unfitted.osim", skeleton_text(unfitted(self.fit))

    def _b3d(self) -> B3dFile:
        """All trials whole, on the grid."""
        low = {
            one.name: LowPassed(one.filtered.motion, one.filtered.marker_errors, one.cutoff_Hz)
            for one in self.gridded
        }
        return fit_to_b3d(replace(self.fit, trials=tuple(one.trial for one in self.gridded)), low)

    def _rows(self, gridded: GriddedTrial, b3d: B3dTrial) -> TrialRows:
        activity, activity_sub = self.labels[gridded.name].of_frames(gridded.grid)
        return TrialRows(
            subject_id=self.task.who.subject_id,
            trial_id=self.task.who.trial_id(gridded.name),
            gridded=gridded,
            cuts=cuts_of(gridded.verdicts.erroneous),
            skeleton=self.fit.skeleton,
            settings=self.settings,
            last_pass=b3d.passes[-1],
            sides=self.sides,
            activity=activity,
            activity_sub=activity_sub,
        )

    def _pieces(
        self, table: str, rows: Sequence[TrialRows], b3d: B3dFile, starts: dict[str, dict[str, int]]
    ) -> Iterator[pa.Table]:
        """A trial's rows after the other; where each begins is noted."""
        assert self.fit.groundwork is not None
        match = self.fit.groundwork.match
        make: dict[str, Callable[[int], pa.Table]] = {
            "frames": lambda k: frames_table(rows[k]),
            "kinematics": lambda k: kinematics_table(rows[k]),
            "markers": lambda k: markers_table(rows[k], match),
            "joint_centres": lambda k: joint_centres_table(rows[k]),
            "plates": lambda k: plates_table(rows[k], b3d.trials[k].sensors),
        }
        first = 0
        for k, one in enumerate(rows):
            piece = make[table](k)
            starts[one.trial_id] |= {f"{table}_first_row": first, f"{table}_rows": piece.num_rows}
            first += piece.num_rows
            yield piece

    def _root_rows(
        self, rows: Sequence[TrialRows], starts: Mapping[str, Mapping[str, int]]
    ) -> dict[str, list[dict[str, Any]]]:
        who, fit = self.task.who, self.fit
        notes, acts = self._notes(), set(self.extension.trials) if self.extension else set()
        labels = [self.labels[one.gridded.name] for one in rows]
        return {
            "subjects": [
                subject_row(fit, who, self.settings, key=self.task.key, notes=notes, sides=self.sides)
            ],
            "trials": [
                trial_row(one, fit, said, one.gridded.name in acts) | dict(starts[one.trial_id])
                for one, said in zip(rows, labels, strict=True)
            ],
            "segments": [row for one in rows for row in segment_rows(one, fit)],
            "contacts": [row for one in rows for row in contact_rows(one)],
            "activities": [
                row for one, said in zip(rows, labels, strict=True) for row in activity_rows(one, said)
            ],
            "coordinates": coordinate_rows(fit, who.subject_id),
            "reviews": [
                row for one, said in zip(rows, labels, strict=True) for row in review_rows(one, said)
            ],
            "causes": cause_rows(who, self.extension, named_causes(fit.subject)),
        }

    def _notes(self) -> list[str]:
        """What the fit assumed, and what the command line filled in; nobody's name in it."""
        filled = [f"{key}: from the command line, subject.toml does not say" for key in self.task.who.filled]
        labels = {name for one in self.fit.trials for name in one.capture.markers.names}
        prefixes = sorted({name.rsplit(":", 1)[0] for name in labels if ":" in name})
        said = [without_names(note, self.fit.subject.folder, prefixes) for note in all_notes(self.fit)]
        return [*filled, *dict.fromkeys(said)]

    def _cut_away(self, rows: Sequence[TrialRows]) -> Iterator[LeftOut]:
        for one in rows:
            rate = one.gridded.grid.rate
            for level, reason, pieces in (
                ("range", "erroneous", one.cuts.erroneous),
                ("segment", "too_short", one.cuts.too_short),
            ):
                for piece in pieces:
                    hours = hours_of(piece.frames, rate)
                    yield LeftOut(
                        level, one.trial_id, reason, "", piece.start, piece.end, piece.frames, hours
                    )


def _inputs(provenance: Mapping[str, str]) -> dict[str, str]:
    """SHA-256 of what was read, by path in the subject."""
    files = {name: value for name, value in provenance.items() if name.startswith("sha256 ")}
    return {name.removeprefix("sha256 "): value for name, value in sorted(files.items())}
