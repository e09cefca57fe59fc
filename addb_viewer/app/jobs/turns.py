"""How many solves and diagnoses of all subjects are at work at once: as many as there are processors.

The app gives each of its processes the same open file, in which one byte stands for one processor. Whoever
has locked a byte is at work, all others wait; what a process had locked is free again however it ends. A
system without such locks has no limit.
"""

import os
import tempfile
import time
from collections.abc import Callable

from solver.common.file_lock import HAS_LOCKS, byte_taken

GIVEN = "ADDB_VIEWER_TURNS"  # in a process's environment: the open file's number, and how many may be at work
LOOK_EVERY_S = 0.3
WAITING = "waiting for other subjects' work"


class Turns:
    """What the app gives to its processes."""

    def __init__(self, most: int | None = None) -> None:
        """Nobody is at work.

        Args:
            most: how many may be at once; None: as many as there are processors for this one.
        """
        self._file = tempfile.TemporaryFile() if HAS_LOCKS else None  # noqa: SIM115 (open as long as the app)
        self._most = most or processors()

    @property
    def environment(self) -> dict[str, str]:
        """For `wait_for_turn`, beside what the app has itself."""
        given = {} if self._file is None else {GIVEN: f"{self._file.fileno()} {self._most}"}
        return os.environ | given

    @property
    def open_files(self) -> tuple[int, ...]:
        """That the process has to inherit."""
        return () if self._file is None else (self._file.fileno(),)


def processors() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def wait_for_turn(progress: Callable[[str, float], None]) -> None:
    """In a process of the app: come back when fewer than all processors are at work; then it is, to its end.

    Args:
        progress: told once that it waits.
    """
    file, most = (int(number) for number in os.environ.pop(GIVEN, "0 0").split())
    if not most or _takes_one(file, most):
        return
    progress(WAITING, -1.0)
    while not _takes_one(file, most):
        time.sleep(LOOK_EVERY_S)


def _takes_one(file: int, most: int) -> bool:
    """Also where there are no locks."""
    return any(byte_taken(file, k) is not False for k in range(most))
