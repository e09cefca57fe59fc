"""One subject from its recordings to its files of the release: what a worker does.

`python -m addb_viewer.dataset.subject_task TASK.json` does it in a process of its own.
"""

import os
import resource
import signal
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from addb_viewer.dataset.left_out import LeftOut
from addb_viewer.dataset.receipts import Receipt, write_receipt
from addb_viewer.dataset.task import Task, read_task

DISK_FAILED = 75  # exit code: try again


def run_task(task: Task) -> Receipt:
    """Fit, write the files, and last the receipt that says so; an error of the data is an answer as well.

    Raises:
        OSError: the disk; it may be tried again.
    """
    from addb_viewer.dataset.subject_files import write_subject_files  # noqa: PLC0415 (loads the solver)
    from annotations.errors import ReviewError  # noqa: PLC0415 (likewise)
    from solver.common.errors import SolverError  # noqa: PLC0415 (likewise)

    began = time.monotonic()
    try:
        made = write_subject_files(task)
    except (SolverError, ReviewError, ValueError, ArithmeticError, LookupError) as error:
        if isinstance(error.__cause__, OSError):
            raise error.__cause__ from error
        why = " ".join(str(error).split()) or type(error).__name__
        made = Receipt(task.key, failed=LeftOut("subject", task.who.subject_id, "fit_failed", why))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    receipt = replace(made, seconds=time.monotonic() - began, peak_MB=peak)
    write_receipt(receipt, task.out)
    return receipt


def main(words: Sequence[str]) -> int:
    """Do the task of a file."""
    threading.Thread(target=_end_with_stdin, name="end of the parent", daemon=True).start()
    try:
        run_task(read_task(Path(words[0])))
    except OSError as error:
        sys.stderr.write(f"{error.filename or ''}: {error.strerror}\n")
        return DISK_FAILED
    return 0


def _end_with_stdin() -> None:
    """End this process once nobody holds the other end of stdin: the parent is gone, also by SIGKILL."""
    while os.read(sys.stdin.fileno(), 1):
        pass
    os.kill(os.getpid(), signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
