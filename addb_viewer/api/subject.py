"""A subject: recordings to fit, to review, to diagnose."""

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from addb_viewer.api.acceptance import Acceptance
from addb_viewer.api.arrays_folder import Person, write_recordings
from addb_viewer.api.diagnosis import Cause, Diagnosis
from addb_viewer.api.fit import Fit
from addb_viewer.api.labelled import Table
from addb_viewer.api.progress import Watcher, watched
from addb_viewer.api.recording import Plate, Recording, capture_from, recording_from
from addb_viewer.jobs.diagnosing import diagnosed, kept_of
from addb_viewer.jobs.reviewing import capture_of, flagged, foot_meant, login_name, noted, trial_of
from addb_viewer.jobs.solving import Job, job_for, last_fit, solved
from addb_viewer.kept_diagnosis import FILE as DIAGNOSIS
from addb_viewer.review_store import has_log, open_log
from annotations.errors import ReviewError
from annotations.events import ClearRange, FlagRange
from annotations.reasons import MANUAL_REVIEW, reason_named
from solver.capture.b3d.places import subject_folder_of
from solver.capture.capture import Subject as OpenedSubject
from solver.capture.capture import UnusedFile
from solver.errors import CaptureError
from solver.results.store import default_folder
from solver.settings import settings_from


@dataclass(frozen=True, eq=False, repr=False)
class Subject:
    """One person's recordings: `Subject.open`, `Subject.from_arrays` or `Subject.demo` give one.

    Results, flags and decisions lie on the disk, where the command line and the app find them too.
    """

    folder: Path  # of the recordings
    results: Path  # folder of the results
    settings: Path | Mapping[str, Any] | None = None  # instead of the folder's settings.toml
    marker_map: Path | None = None  # what labels mean, instead of the folder's markers.toml
    ignore_reviews: bool = False
    _keeps: object = field(default=None)  # a temporary folder, removed with the last who needs it

    @classmethod
    def open(
        cls,
        path: str | Path,
        *,
        results: str | Path | None = None,
        settings: str | Path | Mapping[str, Any] | None = None,
        marker_map: str | Path | None = None,
        ignore_reviews: bool = False,
    ) -> Self:
        """Open a subject's folder or a .b3d file; recordings are read when something is computed.

        Args:
            path: folder of the recordings and, if any, the model; or a .b3d file.
            results: where results go; None: `results` in the folder, or beside the .b3d file.
            settings: a TOML file, or tables as in it, `{"detection": {"confidence": 0.8}}`; None: the
                folder's own.
            marker_map: a file that says what labels mean; None: the folder's.
            ignore_reviews: leave out what people flagged, here or in a review.json.

        Raises:
            SolverError: no such folder, or nothing in it to fit.
        """
        folder = subject_folder_of(Path(path))
        subject = cls(
            folder,
            default_folder(folder) if results is None else Path(results),
            settings if settings is None or isinstance(settings, Mapping) else Path(settings),
            None if marker_map is None else Path(marker_map),
            ignore_reviews,
        )
        subject._job()
        return subject

    @classmethod
    def from_arrays(
        cls,
        markers: np.ndarray,
        marker_names: Sequence[str],
        times: np.ndarray,
        *,
        plates: Sequence[Plate] = (),
        up: str = "y",
        name: str = "trial",
        mass_kg: float | None = None,
        height_m: float | None = None,
        sex: str | None = None,
        model: str | Path | None = None,
        static: Recording | None = None,
        folder: str | Path | None = None,
        settings: Mapping[str, Any] | None = None,
        check: bool = True,
    ) -> Self:
        """A subject of one trial that lies in memory; `from_recordings` takes several.

        Args:
            markers: [frames, markers, 3] [m], NaN where not seen.
            marker_names: of each.
            times: of each frame [s], uniform.
            plates: force plates in the markers' axes and on their clock.
            up: the axis that points up: "y", "z", "-x", ...
            name: of the trial.
            mass_kg: of the person; None: the forces weigh them.
            height_m: likewise; None: from the legs.
            sex: "male" or "female", where known.
            model: an OpenSim model; None: the default full body.
            static: somebody who stands still, to scale the body with.
            folder: where recordings and results go; None: a temporary folder, removed with the last of the
                subject and its fits.
            settings: tables as in settings.toml.
            check: refuse arrays that contradict units, axes or signs as stated here.

        Raises:
            CaptureError: shapes or times do not fit, or a check fails.
        """
        one = Recording(markers, marker_names, times, plates, up)
        return cls.from_recordings(
            {name: one},
            mass_kg=mass_kg,
            height_m=height_m,
            sex=sex,
            model=model,
            static=static,
            folder=folder,
            settings=settings,
            check=check,
        )

    @classmethod
    def from_recordings(
        cls,
        recordings: Mapping[str, Recording],
        *,
        mass_kg: float | None = None,
        height_m: float | None = None,
        sex: str | None = None,
        model: str | Path | None = None,
        static: Recording | None = None,
        folder: str | Path | None = None,
        settings: Mapping[str, Any] | None = None,
        check: bool = True,
    ) -> Self:
        """A subject of several trials that lie in memory.

        Args:
            recordings: by trial.
            mass_kg: of the person; this and the others as for `from_arrays`.
            height_m: of the person.
            sex: of the person.
            model: an OpenSim model.
            static: to scale the body with.
            folder: where recordings and results go.
            settings: tables as in settings.toml.
            check: refuse contradictions.

        Raises:
            CaptureError: there is none, shapes or times do not fit, or a check fails.
        """
        person = Person(mass_kg, height_m, sex, None if model is None else Path(model))
        if not recordings:
            raise CaptureError("no recordings; give one a trial, by name.")
        captures = [capture_from(name, one, check=check) for name, one in recordings.items()]
        standing = None if static is None else capture_from("static", static, check=check)
        keeps = None if folder else tempfile.TemporaryDirectory(prefix="addb-viewer-")
        place = Path(folder) if folder else Path(keeps.name, "subject")  # type: ignore[union-attr]
        write_recordings(place, captures, standing, person)
        return cls(place, default_folder(place), settings, _keeps=keeps)

    @classmethod
    def demo(cls, folder: str | Path | None = None, *, trials: Sequence[str] = ("walk",)) -> Self:
        """A made-up person who walks over force plates and misses one of them, as in `addb-viewer demo`.

        Args:
            folder: to write into; None: a temporary one.
            trials: of "static", "walk", "squat", "run".

        Raises:
            CaptureError: the folder holds something else, or cannot be written to.
        """
        from addb_viewer.jobs.demo import make_demo  # noqa: PLC0415 (the simulator; few ask)

        keeps = None if folder else tempfile.TemporaryDirectory(prefix="addb-viewer-")
        place = Path(folder) if folder else Path(keeps.name, "subject")  # type: ignore[union-attr]
        make_demo(place, trials=trials)
        return cls(place, default_folder(place), _keeps=keeps)

    def __repr__(self) -> str:
        """Name and trials."""
        return f"<Subject {self.name}: {', '.join(self.trials)}>"

    @property
    def name(self) -> str:
        """The folder's name, or the file's without its ending."""
        return self._opened.name

    @property
    def trials(self) -> tuple[str, ...]:
        """Names of the trials."""
        return tuple(trial.name for trial in self._opened.trials)

    @property
    def mass_kg(self) -> float | None:
        """As entered [kg]; None: the forces weigh the person."""
        return self._opened.mass_kg

    @property
    def height_m(self) -> float | None:
        """As entered [m]; None: from the legs."""
        return self._opened.height_m

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed or ignored about the folder."""
        return self._job().subject.notes

    @property
    def unused(self) -> tuple[UnusedFile, ...]:
        """Files of the folder that no fit reads, and why."""
        return self._opened.unused

    def recording(self, trial: str) -> Recording:
        """A trial as it is read: metres, newtons, y up, forces on the person.

        Raises:
            CaptureError: no such trial, or its files cannot be read.
        """
        opened = self._opened
        return recording_from(capture_of(opened, trial_of(opened, trial)))

    def fit(
        self,
        trials: Sequence[str] | None = None,
        *,
        again: bool = False,
        with_accepted: bool = True,
        withheld: bool = False,
        progress: Watcher = None,
    ) -> Fit:
        """Scale the body, fit every trial's motion, and keep the fit in the results folder.

        Where nothing changed, the kept fit stands; where only flags did, the search begins at it.

        Args:
            trials: those to fit, together; None: all.
            again: solve from the beginning whatever is kept.
            with_accepted: use the causes that somebody accepted.
            withheld: judge the fit on all layouts of withheld forces, not on the first alone; takes longer
                than the fit.
            progress: True for a bar in the terminal, or a function of the stage's name and the fraction done,
                `print` for one; raise `Cancelled` in it to stop.

        Raises:
            SolverError: no trial can be read, or the model or the data cannot be used.
            Cancelled: `progress` raised it; nothing was written.
        """
        job = self._job(trials=trials, without_extension=not with_accepted)
        with watched(progress) as told:
            done = solved(job, force=again, progress=told)
            fit = done.fit
            if withheld:
                from addb_viewer.jobs.withholding import Withholding  # noqa: PLC0415 (rarely needed)

                judging = Withholding(fit, job.results, done.files[1].parent.name)
                if judging.is_due:
                    judging.run(job.settings, told, job.extension)
                fit = judging.fit
        return Fit(fit, job.results, done.new, self._keeps)

    def last_fit(self) -> Fit | None:
        """The kept fit, whatever it was made of; None where there is none that can be read."""
        found = last_fit(self._job())
        return None if found is None else Fit(found, self.results, new=False, _keeps=self._keeps)

    def diagnose(
        self, trials: Sequence[str] | None = None, *, again: bool = False, progress: Watcher = None
    ) -> Diagnosis:
        """Say what is wrong with the recordings, why, and how sure that is; keep the answer.

        Where nothing changed, the kept answer stands. Causes that were accepted are looked for like others.

        Args:
            trials: those to look at, together; None: all.
            again: diagnose anew whatever is kept.
            progress: as for `fit`.

        Raises:
            SolverError: no trial has forces, or the model or the data cannot be used.
            Cancelled: `progress` raised it; nothing was written.
        """
        job = self._job(trials=trials, without_extension=True)
        figures = None if again else kept_of(job)
        if figures is not None:
            return Diagnosis(figures, job.results / DIAGNOSIS, new=False)
        with watched(progress) as told:
            figures, file = diagnosed(job, told)
        return Diagnosis(figures, file)

    def accept(
        self,
        causes: Iterable[Cause] | None = None,
        *,
        author: str | None = None,
        progress: Watcher = None,
    ) -> Acceptance:
        """Make causes of the last diagnosis part of the model: later fits use them beside the forces.

        Args:
            causes: those meant; None: all that the diagnosis names.
            author: who decides; None: your login name.
            progress: as for `fit`.

        Raises:
            SolverError: no diagnosis of these recordings is kept, or nothing in it can be accepted.
        """
        from addb_viewer.jobs.accepting import accepted  # noqa: PLC0415 (loads all causes)

        job = self._job(without_extension=True)
        only = None if causes is None else [cause.key for cause in causes]
        with watched(progress) as told:
            done = accepted(job, by=author or login_name(), only=only, progress=told)
        return Acceptance(done.by, done.extension.sentence, done.told, done.left_out, done.file)

    def reject(self, *, author: str | None = None) -> None:
        """Decide against the causes of the last diagnosis: later fits use the recorded forces alone.

        Args:
            author: who decides; None: your login name.

        Raises:
            SolverError: there is nothing to reject.
        """
        from addb_viewer.jobs.accepting import rejected  # noqa: PLC0415 (loads all causes)

        rejected(self._job(without_extension=True), by=author or login_name())

    def flag(
        self,
        trial: str,
        start: int,
        end: int,
        *,
        foot: str = "both",
        reason: str = MANUAL_REVIEW,
        note: str = "",
        author: str | None = None,
    ) -> int:
        """Say that a force is missing or wrong on frames start to end − 1; the next fit leaves it out.

        Args:
            trial: its name.
            start: the first frame, counted from 0.
            end: the first frame after the range.
            foot: "right", "left", "both", or the name of a foot's body.
            reason: why, in the words of `addb-viewer flag --reason`.
            note: what others should know about it.
            author: who decides; None: your login name.

        Returns:
            The edit's number, for `undo`.

        Raises:
            SolverError, ReviewError: no such trial, foot, reason or frames.
        """
        event = partial(FlagRange, start, end, reason_named(reason), note=note)
        return self._noted(trial, (start, end), foot, event, author)

    def clear(
        self,
        trial: str,
        start: int,
        end: int,
        *,
        foot: str = "both",
        note: str = "",
        author: str | None = None,
    ) -> int:
        """Say that the force counts on frames start to end − 1, whatever was said or detected before.

        Arguments, result and errors as for `flag`.
        """
        event = partial(ClearRange, start, end, note=note)
        return self._noted(trial, (start, end), foot, event, author)

    def undo(self, trial: str, *, author: str | None = None) -> None:
        """Take back your last edit of a trial.

        Raises:
            SolverError, ReviewError: no such trial, or nothing to undo.
        """
        opened = self._opened
        trial_of(opened, trial)
        if not has_log(opened.folder):
            raise ReviewError(f"{trial}: nobody has flagged anything yet")
        with open_log(opened.folder) as log:
            log.undo(trial, author or login_name())

    @property
    def flags(self) -> Table:
        """What is flagged: trial, start, end, foot, reason, source, author, edit, note; a row a range."""
        found = flagged(self._opened)
        columns = {"trial": np.array([trial for trial, _ in found], dtype=object)}
        for name in ("start", "end", "foot", "reason", "source", "author", "edit", "note"):
            values = [getattr(flag, name) for _, flag in found]
            texts = ["both" if value is None else str(value) for value in values]
            is_number = name in ("start", "end", "edit")
            columns[name] = np.array(values, int) if is_number else np.array(texts, object)
        return Table(columns)

    @property
    def _opened(self) -> OpenedSubject:
        return self._job(without_extension=True).subject

    def _job(self, *, trials: Sequence[str] | None = None, without_extension: bool = False) -> Job:
        tables = self.settings if isinstance(self.settings, Mapping) else None
        return job_for(
            self.folder,
            out=self.results,
            trials=trials,
            settings_file=None if isinstance(self.settings, Mapping) else self.settings,
            settings=None if tables is None else settings_from(tables, "settings"),
            map_file=self.marker_map,
            ignore_review=self.ignore_reviews,
            without_extension=without_extension,
        )

    def _noted(
        self,
        trial: str,
        frames: tuple[int, int],
        foot: str,
        event: "partial[FlagRange] | partial[ClearRange]",
        author: str | None,
    ) -> int:
        opened = self._opened
        files = trial_of(opened, trial)
        capture = capture_of(opened, files)
        start, end = frames
        if not 0 <= start < end <= capture.markers.frames:
            raise ReviewError(f"{trial}: {start}:{end} is not within the trial, 0:{capture.markers.frames}")
        edit = event(foot=foot_meant(foot, opened.foot_bodies))
        return noted(opened, files, capture, edit, author or login_name()).number
