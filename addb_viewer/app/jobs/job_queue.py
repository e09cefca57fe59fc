"""What is at work for a subject: one command at a time, in a process of its own, seen by all its browsers.

What is asked for meanwhile waits its turn. Work that nobody waits for yields: it ends for whatever is asked
for, and begins again when nothing else waits.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from addb_viewer.app.jobs.worker_process import Outcome, WorkerProcess
from solver.common.errors import SolverError

CLOCK_EVERY = 0.5  # [s] between two looks at the clock
PROGRAM = "addb_viewer"


class BusyError(SolverError):
    """The very same waits its turn already."""


@dataclass(frozen=True)
class Task:
    """One command, in words for people."""

    doing: str  # as notices begin: "Diagnosing failed"
    stage: str  # while it says nothing itself
    module: str
    arguments: tuple[str, ...]
    by: str = ""  # who asked
    yields: bool = False  # to all others; keeps by itself what it has done

    @property
    def words(self) -> str:
        """What is done for whom."""
        return f"{self.doing} for {self.by}" if self.by else self.doing


@dataclass(frozen=True)
class TaskProgress:
    """How far a task is."""

    task: Task
    stage: str
    fraction: float | None  # None where the work does not say
    seconds: float  # since it began
    waiting: tuple[Task, ...] = ()  # that come after it, in order


class JobQueue:
    """Starts, watches and ends the work of one subject."""

    def __init__(
        self, progressed: Callable[[TaskProgress], None], ended: Callable[[Task, Outcome], None]
    ) -> None:
        """Nothing is at work yet.

        Args:
            progressed: told about twice a second.
            ended: told once a task, from a thread of its own.
        """
        self._progressed, self._told_end = progressed, ended
        self.process = WorkerProcess(self._on_progress, self._ended)
        self.task: Task | None = None
        self._lock = threading.RLock()
        self._waiting: list[Task] = []
        self._began, self._said = 0.0, ("", -1.0)

    @property
    def progress(self) -> TaskProgress | None:
        """How far the present task is; None where nothing is at work."""
        task = self.task
        if task is None or not self.process.running:
            return None
        stage, fraction = self._said
        seconds = time.monotonic() - self._began
        return TaskProgress(task, stage, fraction if fraction >= 0 else None, seconds, self.waiting)

    @property
    def waiting(self) -> tuple[Task, ...]:
        """What waits its turn, in order."""
        with self._lock:
            return tuple(self._waiting)

    @property
    def busy(self) -> bool:
        """Whether anything is at work or waits."""
        return bool(self._waiting) or self.process.running

    @property
    def wanted(self) -> bool:
        """Whether anything is at work or waits that somebody has asked for."""
        task = self.task
        at_work = task is not None and not task.yields and self.process.running
        return at_work or any(not waiting.yields for waiting in self.waiting)

    def start(self, task: Task) -> tuple[Task, ...]:
        """Begin a task, or let it wait its turn.

        Returns:
            What comes before it; nothing where it has begun.

        Raises:
            BusyError: the same person's same task waits already.
        """
        with self._lock:
            if task in self._waiting:
                raise BusyError(
                    f"{task.doing} waits its turn already, and begins with what is decided by then"
                )
            if not self._waiting and self._begin(task):
                return ()
            present = self.task
            before = tuple(t for t in (present, *self._waiting) if t is not None)
            if not task.yields:
                before = tuple(t for t in before if not t.yields)
            self._waiting.append(task)
            if present is not None and present.yields and not task.yields:
                if present not in self._waiting:
                    self._waiting.append(present)
                self.process.cancel()
            self._waiting.sort(key=lambda waiting: waiting.yields)
        self._tell()
        return before

    def forget(self, doing: str) -> None:
        """Let no task of that name wait any longer; the present one goes on."""
        with self._lock:
            self._waiting = [task for task in self._waiting if task.doing != doing]

    def drop(self, by: str) -> Task | None:
        """Forget what a person asked for last that still waits; None: nothing does."""
        with self._lock:
            task = next((task for task in reversed(self._waiting) if task.by == by), None)
            if task is not None:
                self._waiting.remove(task)
        self._tell()
        return task

    def cancel(self) -> None:
        """End the task; it leaves nothing behind, and what waits begins."""
        self.process.cancel()

    def close(self) -> None:
        """End the task, and forget what waits."""
        with self._lock:
            self._waiting.clear()
        self.process.cancel()

    def _begin(self, task: Task) -> bool:
        if not self.process.start(task.module, task.arguments):
            return False
        self.task, self._began, self._said = task, time.monotonic(), (task.stage, -1.0)
        threading.Thread(target=self._tick, args=(task,), name="clock of the work", daemon=True).start()
        return True

    def _begin_next(self) -> None:
        with self._lock:
            task = self._waiting.pop(0) if self._waiting else None
            if task is None:
                return
            try:
                if not self._begin(task):  # somebody was quicker
                    self._waiting.insert(0, task)
                return
            except OSError as error:
                outcome = Outcome(False, False, "", f"it cannot be begun ({error})")
        self._told_end(task, outcome)
        self._begin_next()

    def _tell(self) -> None:
        progress = self.progress
        if progress is not None:
            self._progressed(progress)

    def _tick(self, task: Task) -> None:
        while self.process.running and self.task is task:
            progress = self.progress
            if progress is not None:
                self._progressed(progress)
            time.sleep(CLOCK_EVERY)

    def _on_progress(self, stage: str, fraction: float) -> None:
        is_new, self._said = stage != self._said[0], (stage, fraction)
        progress = self.progress if is_new else None
        if progress is not None:
            self._progressed(progress)

    def _ended(self, outcome: Outcome) -> None:
        task = self.task
        try:
            if task is not None:
                self._told_end(task, outcome)
        finally:
            self._begin_next()
