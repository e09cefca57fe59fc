"""Progress in the terminal: the stage, how far it is, and the time left."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from solver.common.progress import Progress

EVERY_S = 60.0  # a line on stderr where no terminal draws a bar: a log shows that the work goes on


@contextmanager
def terminal_progress() -> Iterator[Progress]:
    """Progress that draws a bar on stderr; where that is no terminal, a line each minute."""
    if not sys.stderr.isatty():
        yield _line_each_minute()
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=1.0)
        yield lambda stage, fraction: bars.update(task, description=stage, completed=fraction)


def _line_each_minute() -> Progress:
    last = time.monotonic()

    def shown(stage: str, fraction: float) -> None:
        nonlocal last
        if time.monotonic() - last >= EVERY_S:
            last = time.monotonic()
            print(f"addb-viewer: {stage}, {100 * fraction:.0f} %", file=sys.stderr, flush=True)

    return shown
