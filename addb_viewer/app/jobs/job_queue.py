"""What is at work for a subject: one command at a time, in a process of its own, seen by all its browsers.

What is asked for meanwhile waits its turn.
"""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from addb_viewer.jobs.processes import OwnProcess
from solver.common.errors import SolverError
from solver.common.operating_system import NICE, processors
from solver.common.progress import Progress

CLOCK_EVERY = 0.5  # [s] between two looks at the clock
TURN_EVERY = 0.3  # [s] between two tries to get a turn
PROGRAM = "addb_viewer"
WAITING = "waiting for other subjects' work"


TURNS = threading.Semaphore(processors())  # of solves and diagnoses of all subjects, as many at once


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    succeeded: bool
    cancelled: bool
    said: str  # on stdout, progress aside
    error: str  # why it failed; of one that succeeded, what it warned of


class WorkerProcess:
    """At most one command at a time. Both callbacks come from a thread of its own."""

    def __init__(
        self,
        progress: Progress,
        ended: Callable[[Outcome], None],
        turns: threading.Semaphore = TURNS,
    ) -> None:
        self._progress, self._ended, self._turns = progress, ended, turns
        self._lock = threading.Lock()
        self._process: OwnProcess | None = None
        self._running = self._cancelled = False

    @property
    def running(self) -> bool:
        """Whether a command is at work, or waits for its turn."""
        with self._lock:
            return self._running

    def start(self, command: Sequence[str], *, takes_turn: bool = False) -> bool:
        """Run a command; False where one is running already.

        Args:
            command: module and arguments.
            takes_turn: whether it waits until fewer than all processors are at work.
        """
        with self._lock:
            if self._running:
                return False
            self._running, self._cancelled = True, False
        threading.Thread(target=self._work, args=(command, takes_turn), name="work", daemon=True).start()
        return True

    def cancel(self) -> None:
        """End the command now; its results are written whole or not at all."""
        with self._lock:
            process, self._cancelled = self._process, True
        if process is not None:
            process.cancel()

    def _work(self, command: Sequence[str], takes_turn: bool) -> None:
        has_turn = takes_turn and self._takes_turn()
        try:
            outcome = self._outcome(command)
        finally:
            if has_turn:
                self._turns.release()
        with self._lock:
            self._process, self._running = None, False
        self._ended(outcome)

    def _takes_turn(self) -> bool:
        """Wait for it; False where the command was cancelled meanwhile."""
        if self._turns.acquire(blocking=False):
            return True
        self._progress(WAITING, -1.0)
        while not self._turns.acquire(timeout=TURN_EVERY):
            if self._cancelled:
                return False
        return True

    def _outcome(self, command: Sequence[str]) -> Outcome:
        with self._lock:
            if self._cancelled:
                return Outcome(False, True, "", "")
            try:
                process = self._process = OwnProcess(command, nice=NICE)
            except OSError as error:
                return Outcome(False, False, "", f"it cannot be begun ({error})")
        ended = process.wait(self._progress)
        succeeded = ended.status == 0
        why = ended.own_words if succeeded else ended.reason
        return Outcome(succeeded, self._cancelled, ended.said, why)


class BusyError(SolverError):
    """The very same waits its turn already."""


@dataclass(frozen=True)
class Task:
    """One command, in words for people."""

    doing: str  # as notices begin: "Diagnosing failed"
    stage: str  # while it says nothing itself
    command: tuple[str, ...]  # module and arguments
    by: str  # who asked
    takes_turn: bool = False  # with solves and diagnoses of other subjects

    @property
    def words(self) -> str:
        """What is done for whom."""
        return f"{self.doing} for {self.by}"


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
            before = tuple(t for t in (self.task, *self._waiting) if t is not None)
            self._waiting.append(task)
        self._tell()
        return before

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
        if self.process.running:
            return False
        self.task, self._began, self._said = task, time.monotonic(), (task.stage, -1.0)
        if not self.process.start(task.command, takes_turn=task.takes_turn):
            return False
        threading.Thread(target=self._tick, args=(task,), name="clock of the work", daemon=True).start()
        return True

    def _begin_next(self) -> None:
        with self._lock:
            task = self._waiting.pop(0) if self._waiting else None
            if task is not None and not self._begin(task):  # somebody was quicker
                self._waiting.insert(0, task)

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
