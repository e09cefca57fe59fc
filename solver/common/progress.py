"""How long work tells how far it is, and how it is told to stop."""

from typing import Protocol


class Progress(Protocol):
    """Receives the stage's name and the fraction done, 0 to 1. Raise `Cancelled` in it to stop the work."""

    def __call__(self, stage: str, fraction: float) -> None: ...


def silent(stage: str, fraction: float) -> None:
    """Progress nobody watches."""


def part(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a stage that is only a part of the whole: its 0 to 1 becomes `start` to `end`."""

    def report(stage: str, fraction: float) -> None:
        progress(stage, start + (end - start) * fraction)

    return report
