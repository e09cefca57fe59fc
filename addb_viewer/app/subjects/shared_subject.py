"""A subject as all browsers share it: its fits, its review, and what is at work for it."""

import contextlib
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from addb_viewer.app.jobs.job_queue import PROGRAM, JobQueue, Outcome, Task, TaskProgress
from addb_viewer.app.jobs.what_if_job import WhatIf
from addb_viewer.app.subjects.library import Library
from addb_viewer.app.subjects.people import People
from addb_viewer.app.subjects.shown_fits import ShownFits
from addb_viewer.app.subjects.subject_review import SubjectReview
from addb_viewer.jobs.stored_solves import Solve
from addb_viewer.trial_view.disagreements import disagreements
from annotations.events import Edit
from annotations.review_errors import ReviewError
from annotations.work import Comment, CommentThread
from solver.capture.capture import Capture
from solver.common.errors import SolverError

DIAGNOSING, SOLVING, RECORDING = "Diagnosing", "Solving", "Recording"
WORKERS = "addb_viewer.app.workers"
DIAGNOSE_WORKER: tuple[str, ...] = (WORKERS, "diagnose")
SOLVE_WORKER: tuple[str, ...] = (WORKERS, "solve")


class SubjectListener(Protocol):
    """A browser's session, told what happens to the subject that it shows. Must return soon."""

    def edited(self, edits: Sequence[Edit]) -> None:
        """Somebody recorded edits; none of them: a row came that cannot be read."""

    def fit_changed(self) -> None:
        """Another fit is on the screen, or is compared with."""

    def progressed(self, progress: TaskProgress) -> None:
        """Something is at work."""

    def ended(self, task: Task, outcome: Outcome) -> None:
        """It is not any more."""

    def failed(self, doing: str, error: Exception) -> None:
        """Something that all depend on failed."""

    def told(self, title: str, body: str) -> None:
        """Something happened that all should know."""


class SharedSubject:
    """One subject of the root."""

    def __init__(self, name: str, library: Library, people: People | None = None) -> None:
        """Begin to look after a subject.

        Args:
            name: in the root.
            library: its kept fit.
            people: everybody at a page, also those who look at other subjects.
        """
        self._people = people or People()
        self.name, self.subject = name, library.subject
        self._listeners: list[SubjectListener] = []
        self._lock = threading.RLock()
        self.fits = ShownFits(library, self._fit_came)
        self.what_if = self._asking()
        self.reviews = SubjectReview(
            self.subject,
            self._capture,
            self._edited,
            lambda error: self._tell(lambda listener: listener.failed("Reading the review", error)),
        )
        self.jobs = JobQueue(self._progressed, self._ended)

    @property
    def results(self) -> Path:
        """Where fit, diagnosis and decisions lie."""
        return self.fits.results

    @property
    def is_watched(self) -> bool:
        """Whether anybody looks."""
        return bool(self._listeners)

    def add_listener(self, listener: SubjectListener) -> None:
        """Tell somebody from now on."""
        with self._lock:
            self._listeners = [*self._listeners, listener]

    def remove_listener(self, listener: SubjectListener) -> None:
        """Tell somebody no more."""
        with self._lock:
            self._listeners = [other for other in self._listeners if other is not listener]

    def close(self) -> None:
        """End what is at work, and forget the subject."""
        self.fits.close()
        self.jobs.close()
        self.what_if.close()
        self.reviews.close()

    def solve(self, author: str) -> None:
        """Solve again with the flags and decisions of when it begins; the kept fit stays until one is kept.

        Raises:
            BusyError: that waits its turn already.
        """
        command = (*SOLVE_WORKER, *self._places(), author)
        self._start(Task(SOLVING, "starting", command, author, takes_turn=True))

    @property
    def solving(self) -> bool:
        """Whether a solve is at work or waits."""
        present = [self.jobs.task] if self.jobs.task is not None and self.jobs.process.running else []
        return any(task.doing == SOLVING for task in (*present, *self.jobs.waiting))

    def diagnose(self, author: str) -> None:
        """Look at all trials together.

        Raises:
            BusyError: that waits its turn already.
        """
        command = (*DIAGNOSE_WORKER, *self._places())
        self._start(Task(DIAGNOSING, "starting", command, author, takes_turn=True))

    def cancel(self, author: str) -> None:
        """End what is at work; who asked for it is told, where that is somebody else."""
        task = self.jobs.task
        self.jobs.cancel()
        if task is not None and task.by != author:
            self._people.tell(task.by, f"{author} has cancelled what you asked for", f"{task.doing}.")

    def decide(self, doing: str, command: Sequence[str], stage: str, author: str) -> None:
        """Accept or reject causes that the diagnosis named, as `accept` and `reject` of the command line do.

        Raises:
            BusyError: that waits its turn already.
        """
        folder, results = self._places()
        whole = (PROGRAM, *command, folder, "--out", results, "--author", author)
        self._start(Task(doing, stage, whole, author))

    def record(self, files: Sequence[Path], trial: str | None, author: str) -> None:
        """Write the fit on the screen as a report, or with the one that it is compared with as recordings.

        Args:
            files: `.html`, `.rrd` or `.mcap`; their folder is made where it's missing.
            trial: this one only; None: all.
            author: who asked.

        Raises:
            BusyError: that waits its turn already.
            SolverError: nothing has been fitted yet.
        """
        if self.fits.shown.fit_folder is None:
            raise SolverError("nothing has been fitted yet; G solves")
        folder, results = self._places()
        command = [WORKERS, "record", folder, results, str(self.fits.shown.fit_folder), *map(str, files)]
        if self.fits.compared is not None and self.fits.compared.fit_folder is not None:
            command += ["--previous", str(self.fits.compared.fit_folder)]
        if trial is not None:
            command += ["--trial", trial]
        self._start(Task(RECORDING, "starting", tuple(command), author))

    def answer(self, trial: str, thread: CommentThread, text: str, author: str) -> None:
        """Answer a comment; those who spoke in the talk are told.

        Raises:
            ReviewError: it cannot be recorded.
        """
        self.reviews.say(trial, Comment(text, answers=thread.number), author)
        self._people.tell_of_answer(thread, trial, author, text)

    def keep(self, author: str) -> None:
        """Make the new solve the subject's fit; the next one that waits comes on the screen.

        Raises:
            SolverError: none waits.
        """
        self._decided(self.fits.keep(author), "kept", "It is the subject's fit now.", author)

    def discard(self, author: str, number: int | None = None) -> None:
        """Go back to the kept fit; arguments and errors as for `ShownFits.discard`."""
        solve = self.fits.discard(author, number)
        self._decided(solve, "discarded", "The subject's fit is as it was.", author)

    def compare_with(self, solve: Solve | None) -> None:
        """Put another solve beside the one on the screen, for everybody; as `ShownFits.compare_with`."""
        self.fits.compare_with(solve)
        self._tell(lambda listener: listener.fit_changed())

    def _capture(self, trial: str) -> Capture:
        return self.fits.shown.capture(trial)

    def _places(self) -> tuple[str, str]:
        return str(Path(self.subject.folder).absolute()), str(self.results.absolute())

    def _start(self, task: Task) -> None:
        before = self.jobs.start(task)
        if before:
            names = ", ".join(t.words for t in before)
            self._people.tell(task.by, "It waits its turn", f"{task.doing} begins by itself after: {names}.")
        self._people.queue_changed()

    def _decided(self, solve: Solve, what: str, then: str, author: str) -> None:
        self._fit_replaced()
        if solve.by != author:
            self._people.tell(solve.by, f"{author} has {what} your solve {solve.number}", then)

    def _fit_came(self) -> None:
        """The subject was fitted elsewhere: shown at once, unless a new solve waits on the screen."""
        try:
            shown = self.fits.take_in_elsewhere()
        except SolverError as error:
            failure = error
            self._tell(lambda listener: listener.failed("Reading a new fit", failure))
            return
        if shown:
            self._fit_replaced()
            said = "It is on the screen now."
        else:
            said = "Discard the solve on the screen to see it; keeping that one replaces it."
        self._tell(lambda listener: listener.told("A fit of this subject has come", said))

    def _asking(self) -> WhatIf:
        return WhatIf(self.subject.folder, self.results)

    def _fit_replaced(self) -> None:
        before, self.what_if = self.what_if, self._asking()
        before.close()
        self._tell(lambda listener: listener.fit_changed())

    def _edited(self, edits: Sequence[Edit]) -> None:
        for trial in dict.fromkeys(edit.trial for edit in edits):
            first = min(edit.number for edit in edits if edit.trial == trial)
            with contextlib.suppress(ReviewError):  # the state cannot be told: every page says why
                for name, title, body in disagreements(
                    self.reviews.before(trial, first), self.reviews.review(trial)
                ):
                    self._people.tell(name, title, body)
        self._tell(lambda listener: listener.edited(edits))

    def _progressed(self, progress: TaskProgress) -> None:
        self._tell(lambda listener: listener.progressed(progress))

    def _ended(self, task: Task, outcome: Outcome) -> None:
        if outcome.succeeded and task.doing == SOLVING:
            try:
                self.fits.take_in(outcome.said.split()[-1])
            except Exception as error:  # the answer cannot be read: told like any failure of the solve
                outcome = Outcome(False, False, outcome.said, str(error) or "the solve cannot be found")
            else:
                self._fit_replaced()
        self._tell(lambda listener: listener.ended(task, outcome))
        self._people.queue_changed()

    def _tell(self, what: Callable[[SubjectListener], None]) -> None:
        for listener in self._listeners:
            what(listener)
