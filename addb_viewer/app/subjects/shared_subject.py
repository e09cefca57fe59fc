"""A subject as all browsers share it: its fits and replays, its review, and what is at work for it."""

import contextlib
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from addb_viewer.app.jobs.job_queue import PROGRAM, Progress, Task, Workbench
from addb_viewer.app.jobs.stored_solves import NEW, Solve, discard, keep, prune, solves, waiting
from addb_viewer.app.jobs.what_if import WhatIf
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.subjects.fit_watch import FitWatch
from addb_viewer.app.subjects.library import Library, library_of
from addb_viewer.app.subjects.people import People
from addb_viewer.app.subjects.session_log_writer import LiveLog
from addb_viewer.app.subjects.subject_review import ReviewBook
from addb_viewer.app.trial.disagreements import disagreements
from annotations.errors import ReviewError
from annotations.events import Edit
from solver.capture.capture import Capture
from solver.errors import SolverError
from solver.results.store import has_fit, present_solve
from solver.results.withheld_file import read_withheld
from solver.withheld_stage import layouts_due

DIAGNOSING, SOLVING, RECORDING = "Diagnosing", "Solving", "Recording"
WITHHOLDING = "Judging withheld forces"
WORKERS = "addb_viewer.app.jobs.workers"
DIAGNOSE_WORKER, SOLVE_WORKER = f"{WORKERS}.diagnose", f"{WORKERS}.solve"
RECORD_WORKER, WITHHOLD_WORKER = f"{WORKERS}.record", f"{WORKERS}.withhold"


class Visitor(Protocol):
    """A browser's session, told what happens to the subject that it shows. Must return soon."""

    def edited(self, edits: Sequence[Edit]) -> None:
        """Somebody recorded edits; none of them: a row came that cannot be read."""

    def fit_changed(self) -> None:
        """Another fit is on the screen, or is compared with."""

    def progressed(self, progress: Progress) -> None:
        """Something is at work."""

    def ended(self, task: Task, outcome: Outcome) -> None:
        """It is not any more."""

    def failed(self, doing: str, error: Exception) -> None:
        """Something that all depend on failed."""

    def told(self, title: str, body: str) -> None:
        """Something happened that all should know."""

    def log_changed(self) -> None:
        """The session's log began or ended."""


class SubjectRoom:
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
        self.library = library  # on the screen
        self.other: Library | None = None  # that is compared with
        self.new: Solve | None = None  # on the screen, waiting to be kept or discarded
        self.behind: tuple[Solve, ...] = ()  # other people's solves that wait for the one on the screen
        self._visitors: list[Visitor] = []
        self._opened: set[str] = set()  # trials that somebody has looked at
        self._log: LiveLog | None = None
        self._lock = threading.RLock()
        self.book = ReviewBook(
            self.subject,
            self._capture,
            self._edited,
            lambda error: self._tell(lambda visitor: visitor.failed("Reading the review", error)),
        )
        self.bench = Workbench(self._progressed, self._ended)
        prune(self.results)
        self._show_waiting()
        self.what_if = self._asking()
        self._watch = FitWatch(self.results, self._fit_came)

    @property
    def results(self) -> Path:
        """Where fit, diagnosis and decisions lie."""
        return self.library.results

    @property
    def visited(self) -> bool:
        """Whether anybody looks."""
        return bool(self._visitors)

    def enter(self, visitor: Visitor) -> None:
        """Tell somebody from now on."""
        with self._lock:
            self._visitors = [*self._visitors, visitor]

    def leave(self, visitor: Visitor) -> None:
        """Tell somebody no more."""
        with self._lock:
            self._visitors = [other for other in self._visitors if other is not visitor]

    def close(self) -> None:
        """End what is at work, and forget the subject."""
        self._watch.close()
        self.bench.close()
        self.what_if.close()
        self.end_log()
        self.book.close()

    def solve(self, author: str) -> None:
        """Solve again with the flags and decisions of when it begins; the kept fit stays until one is kept.

        Raises:
            BusyError: that waits its turn already.
        """
        arguments = (*self._places(), author)
        self._start(Task(SOLVING, "starting", SOLVE_WORKER, arguments, author))

    @property
    def withholding_due(self) -> bool:
        """Whether the fit on the screen has not been judged on all layouts of withheld forces."""
        fit = self.library.fit
        return fit is not None and self.library.fit_folder is not None and bool(layouts_due(fit))

    @property
    def solving(self) -> bool:
        """Whether a solve is at work or waits."""
        present = [self.bench.task] if self.bench.task is not None and self.bench.work.running else []
        return any(task.doing == SOLVING for task in (*present, *self.bench.waiting))

    def withhold(self) -> None:
        """Judge the fit on the screen on the layouts that are left, while nothing else is at work."""
        if not self.withholding_due:
            return
        self.bench.forget(WITHHOLDING)
        arguments = (*self._places(), str(self.library.fit_folder))
        self.bench.start(Task(WITHHOLDING, "starting", WITHHOLD_WORKER, arguments, yields=True))
        self._people.queue_changed()

    def diagnose(self, author: str) -> None:
        """Look at all trials together.

        Raises:
            BusyError: that waits its turn already.
        """
        self._start(Task(DIAGNOSING, "starting", DIAGNOSE_WORKER, self._places(), author))

    def cancel(self, author: str) -> None:
        """End what is at work; who asked for it is told, where that is somebody else."""
        task = self.bench.task
        self.bench.cancel()
        if task is not None and task.by != author:
            self._people.tell(task.by, f"{author} has cancelled what you asked for", f"{task.doing}.")

    def decide(self, doing: str, command: str, stage: str, author: str) -> None:
        """Accept or reject the causes that the diagnosis named.

        Raises:
            BusyError: that waits its turn already.
        """
        folder, results = self._places()
        arguments = (command, folder, "--out", results, "--author", author)
        self._start(Task(doing, stage, PROGRAM, arguments, author))

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
        if self.library.fit_folder is None:
            raise SolverError("nothing has been fitted yet; G solves")
        folder, results = self._places()
        arguments = [folder, results, str(self.library.fit_folder), *map(str, files)]
        if self.other is not None and self.other.fit_folder is not None:
            arguments += ["--previous", str(self.other.fit_folder)]
        if trial is not None:
            arguments += ["--trial", trial]
        self._start(Task(RECORDING, "starting", RECORD_WORKER, tuple(arguments), author))

    @property
    def log(self) -> LiveLog | None:
        """The log of the session, while one is written."""
        return self._log

    def begin_log(self, file: Path | None = None) -> None:
        """Write down from now on what happens; nothing changes where that is done already.

        Args:
            file: new; None: one below the results folder, named after the time.

        Raises:
            ResultsError: the file cannot be made.
        """
        from addb_viewer.recordings.session_log import SessionLog  # noqa: PLC0415 (slow to load)

        with self._lock:
            if self._log is not None:
                return
            name = self.subject.name
            log = SessionLog(file, name) if file is not None else SessionLog.begin(self.results, name)
            self._log = LiveLog(log, self.book.since, self._log_failed)
            for trial in sorted(self._opened):
                self._log.opened(trial, self.library, self.other)
        self._tell(lambda visitor: visitor.log_changed())

    def end_log(self) -> None:
        """Close the log, if one is written."""
        with self._lock:
            log, self._log = self._log, None
        if log is not None:
            log.close()
            self._tell(lambda visitor: visitor.log_changed())

    def opened(self, trial: str) -> None:
        """Somebody looks at a trial."""
        with self._lock:
            self._opened.add(trial)
            if self._log is not None:
                self._log.opened(trial, self.library, self.other)

    def keep(self, author: str) -> None:
        """Make the new solve the subject's fit; the next one that waits comes on the screen.

        Raises:
            SolverError: none waits.
        """
        with self._lock:
            solve = self._waiting()
            with self._watch.own_fit():
                keep(solve, self.results, self.subject.folder, author)
            self.new = None
            if waiting(solves(self.results)):
                self.library = library_of(self.subject, self.library.results_folder)
            else:
                self.library.fit_folder = self.results
                self.library.fit_time_ns = (self.results / "fit.json").stat().st_mtime_ns
            self._show_waiting()
        self._decided(solve, "kept", "It is the subject's fit now.", author)
        self.withhold()

    def discard(self, author: str, number: int | None = None) -> None:
        """Go back to the kept fit; the next one that waits comes on the screen.

        Args:
            author: who does.
            number: of the solve that is meant; None: the one on the screen.

        Raises:
            SolverError: none waits, or another one.
        """
        with self._lock:
            solve = self._waiting()
            if number is not None and solve.number != number:
                raise SolverError(f"solve {number} does not wait any more")
            discard(solve, author)
            self.new = None
            self.library, self.other = library_of(self.subject, self.library.results_folder), None
            self._show_waiting()
        self._decided(solve, "discarded", "The subject's fit is as it was.", author)

    def compare_with(self, solve: Solve | None) -> None:
        """Put another solve beside the one on the screen; None: the kept fit, beside a new one.

        Raises:
            ResultsError: it cannot be read.
        """
        folder = None if solve is None else solve.folder
        other = library_of(self.subject, self.library.results_folder, folder)
        with self._lock:
            self.other = other if other.fit is not None else None
        self._tell(lambda visitor: visitor.fit_changed())

    def _capture(self, trial: str) -> Capture:
        return self.library.capture(trial)

    def _waiting(self) -> Solve:
        if self.new is None:
            raise SolverError("no new solve waits to be kept or discarded; G solves again")
        return self.new

    def _places(self) -> tuple[str, str]:
        return str(Path(self.subject.folder).absolute()), str(self.results.absolute())

    def _start(self, task: Task) -> None:
        before = self.bench.start(task)
        if before:
            names = ", ".join(f"{t.doing} for {t.by}" if t.by else t.doing for t in before)
            self._people.tell(task.by, "It waits its turn", f"{task.doing} begins by itself after: {names}.")
        self._people.queue_changed()

    def _decided(self, solve: Solve, what: str, then: str, author: str) -> None:
        self._note(f"the new solve is {what}")
        self._fit_replaced()
        if solve.by != author:
            self._people.tell(solve.by, f"{author} has {what} your solve {solve.number}", then)

    def _show_waiting(self) -> None:
        """The first solve that nobody has decided about, also before the app ended, is on the screen."""
        found = waiting(solves(self.results))
        if found:
            self._show_new(found[0])
        self.behind = found[1:]

    def _take_in(self, solve: Solve) -> None:
        """A solve has come: on the screen, unless somebody else's waits there; kept where it is the first."""
        with self._lock:
            if not has_fit(self.results):
                with self._watch.own_fit():
                    keep(solve, self.results, self.subject.folder)
                self.library, self.other = library_of(self.subject, self.library.results_folder), None
            elif self.new is None or self.new.by == solve.by:
                self._show_new(solve)
            for old in solves(self.results):  # the same person's last one is the one that waits
                if old.state == NEW and old.by == solve.by and old.number < solve.number:
                    discard(old)
            shown = -1 if self.new is None else self.new.number
            self.behind = tuple(s for s in waiting(solves(self.results)) if s.number != shown)

    def _show_new(self, solve: Solve) -> None:
        library = library_of(self.subject, self.library.results_folder, solve.folder)
        with self._lock:
            kept = self.library if self.new is None else self.other
            self.other = kept if kept is not None and kept.fit is not None else None
            self.library, self.new = library, solve

    def _fit_came(self) -> None:
        """The subject was fitted elsewhere: shown at once, unless a new solve waits on the screen."""
        with self._lock:
            waits = self.new is not None
            try:
                if not waits:
                    self.library = library_of(self.subject, self.library.results_folder)
                    self.other = None
            except SolverError as error:
                failure = error
                self._tell(lambda visitor: visitor.failed("Reading a new fit", failure))
                return
        if waits:
            said = "Discard the solve on the screen to see it; keeping that one replaces it."
        else:
            self._fit_replaced()
            said = "It is on the screen now."
        self._tell(lambda visitor: visitor.told("A fit of this subject has come", said))

    def _asking(self) -> WhatIf:
        return WhatIf(self.subject.folder, self.library.results, self.library.fit_folder)

    def _fit_replaced(self) -> None:
        before, self.what_if = self.what_if, self._asking()
        before.close()
        with self._lock:
            if self._log is not None:
                for trial in sorted(self._opened):
                    self._log.opened(trial, self.library, self.other)
        self._tell(lambda visitor: visitor.fit_changed())

    def _edited(self, edits: Sequence[Edit]) -> None:
        for trial in dict.fromkeys(edit.trial for edit in edits):
            first = min(edit.number for edit in edits if edit.trial == trial)
            with contextlib.suppress(ReviewError):  # the state cannot be told: every page says why
                for name, title, body in disagreements(
                    self.book.before(trial, first), self.book.review(trial)
                ):
                    self._people.tell(name, title, body)
        self._tell(lambda visitor: visitor.edited(edits))
        if self._log is not None:
            self._log.edited()

    def _progressed(self, progress: Progress) -> None:
        if self._log is not None:
            self._log.progressed(progress)
        self._tell(lambda visitor: visitor.progressed(progress))

    def _take_in_withheld(self, task: Task) -> None:
        """Layouts have come, some of them also where the work was ended."""
        with self._lock:
            library, folder = self.library, self.library.fit_folder
            if library.fit is None or folder is None or str(folder) != task.arguments[-1]:
                return
            if (folder / "fit.json").stat().st_mtime_ns != library.fit_time_ns:
                return
            layouts = read_withheld(folder / present_solve(folder), self.subject.folder)
            library.fit = replace(library.fit, withheld=layouts)

    def _note(self, text: str) -> None:
        if self._log is not None:
            self._log.note(text)

    def _log_failed(self, error: Exception) -> None:
        self._tell(lambda visitor: visitor.failed("Writing the log of the session", error))

    def _ended(self, task: Task, outcome: Outcome) -> None:
        if outcome.succeeded and task.doing == SOLVING:
            try:
                number = outcome.said.split()[-1]
                self._take_in(next(s for s in solves(self.results) if s.folder.name == number))
            except Exception as error:  # the answer cannot be read: told like any failure of the solve
                outcome = Outcome(False, False, outcome.said, str(error) or "the solve cannot be found")
            else:
                self._fit_replaced()
        if task.doing == WITHHOLDING:
            try:
                self._take_in_withheld(task)
            except (SolverError, OSError) as error:
                outcome = Outcome(False, False, outcome.said, str(error))
        if self._log is not None:
            self._log.ended(task, outcome)
            if outcome.succeeded and task.doing == DIAGNOSING:
                self._log.diagnosed(self.results)
        self._tell(lambda visitor: visitor.ended(task, outcome))
        self._people.queue_changed()
        if outcome.succeeded and task.doing == SOLVING:
            self.withhold()

    def _tell(self, what: Callable[[Visitor], None]) -> None:
        for visitor in self._visitors:
            what(visitor)
