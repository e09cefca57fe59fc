"""How long work tells how far it is, and how it is told to stop."""

from collections.abc import Callable
from typing import Protocol

from solver.common.errors import Cancelled


class Progress(Protocol):
    """Receives the stage's name and the fraction done, 0 to 1. Raise `Cancelled` in it to stop the work."""

    def __call__(self, stage: str, fraction: float) -> None: ...


def silent(stage: str, fraction: float) -> None:
    """Progress nobody watches."""


def cancellable(progress: Progress, is_cancelled: Callable[[], bool]) -> Progress:
    """Progress that raises `Cancelled` at the next report once `is_cancelled()` is true."""

    def report(stage: str, fraction: float) -> None:
        if is_cancelled():
            raise Cancelled(f"Stopped during {stage}; nothing was written.")
        progress(stage, fraction)

    return report


def part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a stage that is only a part of the whole: its 0 to 1 becomes `start` to `end`."""

    def report(stage: str, fraction: float) -> None:
        progress(stage, start + (end - start) * fraction)

    return report
