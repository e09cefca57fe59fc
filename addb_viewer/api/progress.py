"""Who watches long work: nobody, a bar in the terminal, or a function of the caller's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeAlias

from addb_viewer.terminal_progress import terminal_progress
from solver.progress import Progress, silent

Watcher: TypeAlias = Progress | bool | None


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
