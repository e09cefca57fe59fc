"""A subject: recordings to fit, to review, to diagnose."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np

from addb_viewer.api.acceptance import Acceptance
from addb_viewer.api.labelled import Table
from addb_viewer.api.opened_recordings import OpenedRecordings
from addb_viewer.api.subject_diagnosis import Cause, Diagnosis
from addb_viewer.api.subject_fit import Fit
from addb_viewer.jobs.diagnosing import diagnosed, kept_of
from addb_viewer.jobs.kept_diagnosis import FILE as DIAGNOSIS
from addb_viewer.jobs.review_store import has_log, open_log
from addb_viewer.jobs.reviewing import capture_of, flagged, foot_meant, login_name, noted, trial_of
from addb_viewer.jobs.solving import last_fit, solved
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.trial_view.kept_verdicts import kept_verdicts
from addb_viewer.trial_view.trial_verdict import TrialVerdict
from annotations.events import ClearRange, FlagRange
from annotations.reasons import MANUAL_REVIEW, reason_named
from annotations.review_errors import ReviewError
from solver.common.progress import Progress, silent

Watcher: TypeAlias = Progress | bool | None


@dataclass(frozen=True, eq=False, repr=False)
class Subject(OpenedRecordings):
    """One person's recordings: `Subject.open`, `Subject.from_arrays` or `Subject.demo` give one.

    Results, flags and decisions lie on the disk, where the command line and the app find them too.
    """

    def fit(
        self,
        trials: Sequence[str] | None = None,
        *,
        again: bool = False,
        with_accepted: bool = True,
        progress: Watcher = None,
    ) -> Fit:
        """Scale the body, fit every trial's motion, and keep the fit in the results folder.

        Where nothing changed, the kept fit stands; where only flags did, the search begins at it. A fit of
        some trials is not kept where it would take the place of one that has others as well.

        Args:
            trials: those to fit, together; None: all.
            again: solve from the beginning whatever is kept.
            with_accepted: use the causes that somebody accepted.
            progress: True for a bar in the terminal, or a function of the stage's name and the fraction done,
                `print` for one; raise `Cancelled` in it to stop.

        Raises:
            SolverError: no trial can be read, or the model or the data cannot be used.
            Cancelled: `progress` raised it; nothing was written.
        """
        job = self._job(trials=trials, without_extension=not with_accepted)
        with watched(progress) as told:
            done = solved(job, force=again, progress=told)
        return Fit(done.fit, job.results, done.new, self._keeps)

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
            causes: those meant, what was decided about others stays; None: all that the diagnosis names.
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
        return Acceptance(done.by, done.extension.sentence, done.gain, done.left_out, done.file)

    def reject(
        self,
        causes: Iterable[Cause] | None = None,
        *,
        author: str | None = None,
        progress: Watcher = None,
    ) -> None:
        """Decide against causes of the last diagnosis: later fits use the recorded forces without them.

        Args:
            causes: those meant, what was decided about others stays; None: all that the diagnosis names.
            author: who decides; None: your login name.
            progress: as for `fit`; of use where others stay accepted, which are then fitted anew.

        Raises:
            SolverError: there is nothing to reject.
        """
        from addb_viewer.jobs.accepting import rejected  # noqa: PLC0415 (loads all causes)

        only = None if causes is None else [cause.key for cause in causes]
        with watched(progress) as told:
            rejected(self._job(without_extension=True), by=author or login_name(), only=only, progress=told)

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
    def verdicts(self) -> Mapping[str, TrialVerdict]:
        """What each trial is good for, why, and what is open, by its name; `.line.text` says it in a line.

        Raises:
            SolverError, ReviewError: fit or review cannot be read.
        """
        return kept_verdicts(self._opened, self.results)

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


@contextmanager
def watched(watcher: Watcher) -> Iterator[Progress]:
    """Progress for the solver.

    Args:
        watcher: None: nobody; True: a bar, where a terminal is there; else called with the stage's name and
            the fraction done, and may raise `Cancelled`.
    """
    if watcher is True:
        with terminal_progress() as progress:
            yield progress
    else:
        yield watcher or silent
