"""A solved subject's files of a release, written trial after trial: memory holds one trial at a time."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, overload

import numpy as np
import pyarrow as pa

from addb_viewer.dataset.build_task import LeftOut, MadeFile, Receipt, Task, emptied, hours_of, made_file
from addb_viewer.dataset.frame_rows import (
    TrialRows,
    frames_table,
    joint_centres_tables,
    kinematics_table,
    markers_tables,
    plates_tables,
)
from addb_viewer.dataset.grid import cuts_of
from addb_viewer.dataset.gridded_trial import GriddedTrial, on_grid
from addb_viewer.dataset.identifiers import file_name_of, labels_without_names, without_names
from addb_viewer.dataset.parquet_files import TableFile
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import ReleaseSubject
from addb_viewer.dataset.release_tables import SUBJECT_TABLES
from addb_viewer.dataset.root_rows import (
    Row,
    activity_rows,
    cause_rows,
    contact_rows,
    coordinate_rows,
    review_rows,
    segment_rows,
    subject_row,
    trial_row,
)
from addb_viewer.dataset.scanning import concerns_of
from addb_viewer.dataset.trial_labels import UNKNOWN, TrialLabels, labels_of, named_causes
from addb_viewer.jobs.accepted_extension import extension_for_solve
from addb_viewer.jobs.force_reviews import reviews_for_solve
from addb_viewer.jobs.suggested_activities import suggestions_of
from annotations.foot_names import side_of
from solver.capture.atomic import write_whole
from solver.capture.formats.b3d.b3d_fields import B3dFile, B3dTrial, TrialType
from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.capture.formats.b3d.frames import cut
from solver.capture.subject.opened_subject import open_subject
from solver.common.memory_release import release_memory
from solver.common.notes import Kind, Note, noted
from solver.dynamics.trajectory.extension import Extension
from solver.export.b3d.from_fit import LowPassed, fit_to_b3d, with_unfitted_masses
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.results.store import default_folder
from solver.fitting.settings import Settings, as_toml, settings_for
from solver.fitting.summary import all_notes
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.scaling import with_mass


@dataclass(frozen=True)
class TrialsOnDemand(Sequence[B3dTrial]):
    """In order."""

    makers: tuple[Callable[[], B3dTrial], ...]

    def __len__(self) -> int:
        return len(self.makers)

    @overload
    def __getitem__(self, index: int) -> B3dTrial: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[B3dTrial]: ...

    def __getitem__(self, index: int | slice) -> B3dTrial | Sequence[B3dTrial]:
        if isinstance(index, slice):
            return TrialsOnDemand(self.makers[index])
        return self.makers[index]()


CUSTOM = ("counts", "torque_predicted", "detected_ok")  # a number a frame each, 0 or 1
TYPES = {
    "treadmill": TrialType.TREADMILL,
    "overground": TrialType.OVERGROUND,
    "static": TrialType.STATIC,
    "other": TrialType.OTHER,
}


def subject_b3d(
    whole: B3dFile, who: ReleaseSubject, notes: Sequence[str], segments: Sequence[B3dTrial]
) -> B3dFile:
    """The file: whose it is and on what terms stands in its header.

    Args:
        whole: all trials on the grid.
        who: the subject.
        notes: of the fit, without names.
        segments: what goes into the file.
    """
    first = whole.header.notes.split("\n", 1)[0]
    header = replace(
        whole.header,
        notes="\n".join([first, *notes]),
        marker_name=tuple(labels_without_names(whole.header.marker_name)),
        subject_tag=(who.source, *((who.licence,) if who.licence else ())),
        href=who.url or "",
        age_years=min(whole.header.age_years, 90),
        custom_value_name=CUSTOM,
        custom_value_length=np.ones(len(CUSTOM), np.int32),
    )
    return B3dFile(header, segments)


def segments_of(
    whole: B3dFile, rows: Sequence[TrialRows], labels: Mapping[str, TrialLabels]
) -> TrialsOnDemand:
    """Each segment of each trial as a trial of its own, cut when it is asked for.

    Args:
        whole: all trials on the grid, in the order of the rows.
        rows: of the trials.
        labels: by trial.
    """
    found = []
    for trial, one in zip(whole.trials, rows, strict=True):
        verdicts, said = one.gridded.verdicts, labels[one.gridded.name]
        dynamics = one.gridded.trial.dynamics
        predicted = None if dynamics is None else dynamics.wrench_is_predicted
        none = np.zeros_like(verdicts.counts)
        flags = (
            verdicts.counts,
            none if predicted is None else np.any(predicted, axis=1),
            verdicts.detected_ok,
        )
        sensors = replace(trial.sensors, custom_values=np.column_stack(flags).astype(float))
        header = replace(
            trial.header,
            missing_GRF_reason=verdicts.missing_number.astype(np.int32),
            has_manual_GRF_annotation=verdicts.reviewed,
            trial_type=TYPES[said.trial_type],
            trial_tag=tuple(tag for tag in (said.activity, said.activity_sub) if tag and tag != UNKNOWN),
        )
        own = replace(trial, header=header, sensors=sensors)
        found += [partial(cut, own, piece.start, piece.end, k) for k, piece in enumerate(one.cuts.kept)]
    return TrialsOnDemand(tuple(found))


class SubjectWriting:
    """The files of one subject."""

    def __init__(
        self,
        task: Task,
        fit: Fit,
        settings: Settings,
        extension: Extension | None,
        labels: Mapping[str, TrialLabels],
    ) -> None:
        """Nothing is written yet, but what a killed worker left is removed.

        Args:
            task: what is to be done.
            fit: of the trials that a release takes.
            settings: of the fit.
            extension: accepted causes; None: none.
            labels: of the trials, by name.
        """
        self.task, self.fit, self.settings, self.extension = task, fit, settings, extension
        self.labels = labels
        self.folder = emptied(task.out)
        self.stem = file_name_of(task.who.subject_id)
        bodies = next(trial.contacts.foot_bodies for trial in fit.trials if trial.contacts)
        self.sides = tuple(str(side_of(body)) for body in bodies)
        self.notes = self._notes()

    def receipt(self, left: Sequence[LeftOut]) -> Receipt:
        """Write everything.

        Args:
            left: what was left out before.

        Raises:
            CaptureError: a file cannot be written.
        """
        left = list(left)
        pieces: list[Path] = []
        rows: dict[str, list[Row]] = {
            "coordinates": coordinate_rows(self.fit, self.task.who.subject_id),
            "causes": cause_rows(self.task.who, self.extension, named_causes(self.fit.subject)),
        }
        with ExitStack() as stack:
            tables = {
                table.name: stack.enter_context(TableFile(table, self._place(table.file(self.stem))))
                for table in SUBJECT_TABLES
            }
            for trial in sorted(self.fit.trials, key=lambda one: self.task.who.trial_id(one.capture.name)):
                one, b3d = self._on_grid(trial)
                left += _cut_away(one)
                if not one.cuts.kept:
                    continue
                starts: dict[str, int] = {}
                for name, table in self._tables(one, b3d.trials[0]):
                    starts.setdefault(f"{name}_first_row", tables[name].add(table))
                    starts[f"{name}_rows"] = starts.get(f"{name}_rows", 0) + table.num_rows
                    del table  # before the next one is made
                    release_memory()
                for name, own in self._trial_rows(one, starts):
                    rows.setdefault(name, []).extend(own)
                release_memory()
                pieces.append(self._b3d_piece(b3d, one, len(pieces)))
        if not pieces:
            return Receipt(
                self.task.key,
                left_out=(*left, LeftOut("subject", self.task.who.subject_id, "no_trials", "see its trials")),
            )
        rows["subjects"] = [
            subject_row(
                self.fit, self.task.who, self.settings, key=self.task.key, notes=self.notes, sides=self.sides
            )
        ]
        files = {
            table.file(self.stem): made_file(self.folder / table.file(self.stem), tables[table.name].rows)
            for table in SUBJECT_TABLES
        }
        files |= self._models() | (self._b3d(pieces) if self.task.options.b3d else {})
        return Receipt(
            self.task.key,
            files=files,
            rows=rows,
            inputs=_inputs(self.fit.provenance),
            settings=as_toml(self.settings),
            left_out=tuple(left),
        )

    def _on_grid(self, trial: TrialFit) -> tuple[TrialRows, B3dFile]:
        """A trial on the release's frames, and all passes of it, uncut."""
        finished = self.labels[trial.capture.name].finished
        rate_hz = self.task.options.rate_hz
        gridded = on_grid(self.fit, trial, self.settings, rate_hz, finished=finished)
        release_memory()
        low = LowPassed(gridded.filtered.motion, gridded.filtered.marker_errors, gridded.cutoff_Hz)
        beside = tuple(gridded.trial if other is trial else other for other in self.fit.trials)
        b3d = fit_to_b3d(
            replace(self.fit, trials=beside), {gridded.name: low}, only=gridded.name, scratch=self.folder
        )
        release_memory()
        return self._rows(gridded, b3d.trials[0]), b3d

    def _rows(self, gridded: GriddedTrial, b3d: B3dTrial) -> TrialRows:
        activity, activity_sub, activity_by = self.labels[gridded.name].of_frames(gridded.grid)
        return TrialRows(
            subject_id=self.task.who.subject_id,
            trial_id=self.task.who.trial_id(gridded.name),
            gridded=gridded,
            cuts=cuts_of(gridded.verdicts.erroneous),
            skeleton=self.fit.skeleton,
            settings=self.settings,
            first_pass=b3d.passes[0],
            last_pass=b3d.passes[-1],
            sides=self.sides,
            activity=activity,
            activity_sub=activity_sub,
            activity_by=activity_by,
        )

    def _tables(self, one: TrialRows, b3d: B3dTrial) -> Iterator[tuple[str, pa.Table]]:
        """Its rows of the tables that have a file a subject."""
        assert self.fit.groundwork is not None
        yield "frames", frames_table(one)
        yield "kinematics", kinematics_table(one)
        long = {
            "markers": markers_tables(one, self.fit.groundwork.match),
            "joint_centres": joint_centres_tables(one),
            "plates": plates_tables(one, b3d.sensors),
        }
        yield from ((name, table) for name, pieces in long.items() for table in pieces)

    def _trial_rows(self, one: TrialRows, starts: Mapping[str, int]) -> Iterator[tuple[str, list[Row]]]:
        """Its rows of the tables that the whole release shares."""
        labels = self.labels[one.gridded.name]
        extended = self.extension is not None and one.gridded.name in self.extension.trials
        concerns = concerns_of(one.gridded.name, self.notes, named_causes(self.fit.subject))
        row = trial_row(one, self.fit, labels, extended) | {"concerns": list(concerns)}
        yield "trials", [row | dict(starts)]
        yield "segments", segment_rows(one, self.fit, labels)
        yield "contacts", contact_rows(one)
        yield "activities", activity_rows(one, labels)
        yield "reviews", review_rows(one, labels)

    def _b3d_piece(self, whole: B3dFile, one: TrialRows, number: int) -> Path:
        """The trial's segments in a file of their own, until all are there."""
        path = self.folder / f"{number}.piece.b3d"
        segments = segments_of(whole, [one], self.labels)
        write_b3d(subject_b3d(whole, self.task.who, self.notes, segments), path)
        return path

    def _b3d(self, pieces: Sequence[Path]) -> dict[str, MadeFile]:
        """All segments of all trials in one file; frames go from disk to disk."""
        opened = [read_b3d(path).trials for path in pieces]
        path = f"b3d/{self.stem}.b3d"
        trials = [partial(one.__getitem__, k) for one in opened for k in range(len(one))]
        header = read_b3d(pieces[0]).header
        write_b3d(B3dFile(header, TrialsOnDemand(tuple(trials))), self._place(path))
        for piece in pieces:
            piece.unlink()
        return {path: made_file(self.folder / path)}

    def _models(self) -> dict[str, MadeFile]:
        """The fitted one; and at the entered mass, if any, that which has not seen the forces."""
        made, models = {}, {"osim": self.fit.skeleton}
        if self.fit.subject.mass_kg is not None:
            models["unfitted.osim"] = with_mass(with_unfitted_masses(self.fit), self.fit.subject.mass_kg)
        for name, skeleton in models.items():
            path = f"models/{self.stem}.{name}"
            write_whole(self._place(path), skeleton_text(skeleton))
            made[path] = made_file(self.folder / path)
        return made

    def _place(self, path: str) -> Path:
        place = self.folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        return place

    def _notes(self) -> list[Note]:
        """What the fit assumed, and what the command line filled in; nobody's name in it."""
        keys = self.task.who.filled
        filled = noted(
            Kind.OTHER, *(f"{key}: from the command line, subject.toml does not say" for key in keys)
        )
        labels = {name for one in self.fit.trials for name in one.capture.markers.names}
        prefixes = sorted({name.rsplit(":", 1)[0] for name in labels if ":" in name})
        folder = self.fit.subject.folder
        said = [
            note.reworded(lambda text: without_names(text, folder, prefixes)) for note in all_notes(self.fit)
        ]
        return [*filled, *dict.fromkeys(said)]


def _cut_away(one: TrialRows) -> Iterator[LeftOut]:
    """Stretches of a trial that are in no segment."""
    posed = one.gridded.trial.motion.posed
    pieces = [
        ("range", "erroneous" if posed[piece.rows].any() else "no_pose", piece)
        for piece in one.cuts.erroneous
    ]
    pieces += [("segment", "too_short", piece) for piece in one.cuts.too_short]
    for level, reason, piece in pieces:
        hours = hours_of(piece.frames, one.gridded.grid.rate)
        yield LeftOut(level, one.trial_id, reason, "", piece.start, piece.end, piece.frames, hours)


def _inputs(provenance: Mapping[str, str]) -> dict[str, Any]:
    """SHA-256 of what was read, by path in the subject."""
    files = {name: value for name, value in provenance.items() if name.startswith("sha256 ")}
    return {name.removeprefix("sha256 "): value for name, value in sorted(files.items())}


MODEL_NAME = "subject"  # in model texts: the file's own may be a person's


def write_subject_files(task: Task) -> Receipt:
    """Solve the wanted trials together and write everything that the release has of the subject.

    Always from the beginning: a re-solve depends, within tolerance, on the edits before it.

    Raises:
        SolverError: the data cannot be fitted, or a file cannot be written.
        ReviewError: the reviews cannot be read.
    """
    settings = settings_for(task.place)
    subject = open_subject(task.place)
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
    files = [trial for trial in chosen if trial.name in kept]
    said = labels_of(subject, files, captures, names=task.options.names)
    labels = {
        trial.capture.name: said[trial.capture.name].with_suggestions(suggestions_of(trial, fit.skeleton))
        for trial in fit.trials
    }
    release_memory()
    return SubjectWriting(task, fit, settings, extension, labels).receipt(left)


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
    if not all(np.isfinite(array[trial.motion.posed]).all() for array in arrays):
        return "non_finite", ""
    return None, ""
