"""What is at work for a subject: one command at a time, in a process of its own, seen by all its browsers."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from addb_viewer.app.work import Outcome, Work
from solver.errors import SolverError

CLOCK_EVERY = 0.5  # [s] between two looks at the clock
PROGRAM = "addb_viewer"


class BusyError(SolverError):
    """Something is at work already."""


@dataclass(frozen=True)
class Task:
    """One command, in words for people."""

    doing: str  # as notices begin: "Diagnosing failed"
    stage: str  # while it says nothing itself
    module: str
    arguments: tuple[str, ...]
    by: str = ""  # who asked


@dataclass(frozen=True)
class Progress:
    """How far a task is."""

    task: Task
    stage: str
    fraction: float | None  # None where the work does not say
    seconds: float  # since it began


class Workbench:
    """Starts, watches and ends the work of one subject."""

    def __init__(
        self, progressed: Callable[[Progress], None], ended: Callable[[Task, Outcome], None]
    ) -> None:
        """Nothing is at work yet.

        Args:
            progressed: told about twice a second.
            ended: told once a task, from a thread of its own.
        """
        self._progressed, self._told_end = progressed, ended
        self.work = Work(self._heard, self._ended)
        self.task: Task | None = None
        self._began, self._said = 0.0, ("", -1.0)

    @property
    def progress(self) -> Progress | None:
        """How far the present task is; None where nothing is at work."""
        task = self.task
        if task is None or not self.work.running:
            return None
        stage, fraction = self._said
        return Progress(task, stage, fraction if fraction >= 0 else None, time.monotonic() - self._began)

    def start(self, task: Task) -> None:
        """Begin a task.

        Raises:
            BusyError: another one is at work.
        """
        if not self.work.start(task.module, task.arguments):
            doing = self.task.doing if self.task is not None else "something else"
            raise BusyError(f"{doing} is at work; one thing at a time: wait for it, or cancel it.")
        self.task, self._began, self._said = task, time.monotonic(), (task.stage, -1.0)
        threading.Thread(target=self._tick, args=(task,), name="clock of the work", daemon=True).start()

    def cancel(self) -> None:
        """End the task; it leaves nothing behind."""
        self.work.cancel()

    def _tick(self, task: Task) -> None:
        while self.work.running and self.task is task:
            progress = self.progress
            if progress is not None:
                self._progressed(progress)
            time.sleep(CLOCK_EVERY)

    def _heard(self, stage: str, fraction: float) -> None:
        is_new, self._said = stage != self._said[0], (stage, fraction)
        progress = self.progress if is_new else None
        if progress is not None:
            self._progressed(progress)

    def _ended(self, outcome: Outcome) -> None:
        if self.task is not None:
            self._told_end(self.task, outcome)
