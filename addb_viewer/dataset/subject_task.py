"""One subject from its recordings to its files of the release, in a process of its own.

`python -m addb_viewer.dataset.subject_task TASK.json` does it.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from addb_viewer.dataset.build_task import LeftOut, Receipt, Task, read_task, valid_receipt, write_receipt
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.jobs.environment import end_with_parent
from addb_viewer.jobs.processes import THREADS, Ended, Start
from solver.common.operating_system import peak_memory_MB, signal_of

MODULE = "addb_viewer.dataset.subject_task"  # as a process runs it
ATTEMPTS = 3  # of a task whose process dies, or whose disk fails
DISK_FAILED = 75  # exit code: try again


def done_apart(task: Task, start: Start, time_out_s: float | None = None) -> Receipt:
    """A task's receipt, whatever becomes of its processes.

    Args:
        task: to be done.
        start: a process.
        time_out_s: after which the subject is given up; None: never.

    Raises:
        ReleaseError: the disk fails again and again.
    """
    for _ in range(ATTEMPTS):
        ended = _one_process(task, start, time_out_s)
        if not ended.in_time:
            why = f"not done after {time_out_s:g} s"
            gone = LeftOut("subject", task.who.subject_id, "timed_out", why)
            return Receipt(task.key, failed=gone)  # none on the disk: the next build tries again
        receipt = valid_receipt(task.out, task.key)
        if ended.status == 0 and receipt is not None:
            return receipt
        if ended.status > 0 and ended.status != DISK_FAILED:
            break  # it would end the same way again
    if ended.status == DISK_FAILED:
        raise ReleaseError(f"{task.who.subject_id}: {ended.last_line}")
    if ended.status > 0:
        return lost(task, "fit_failed", f"unexpected {ended.last_line or f'end with {ended.status}'}")
    name = signal_of(ended.status) or "no receipt"
    return lost(task, "worker_died", f"{name}, {ATTEMPTS} times; it had {ended.peak_MB:.0f} MB")


def lost(task: Task, reason: str, why: str) -> Receipt:
    """Of a task that left no receipt itself: it is not tried again."""
    receipt = Receipt(task.key, failed=LeftOut("subject", task.who.subject_id, reason, why))
    write_receipt(receipt, task.out)
    return receipt


def _one_process(task: Task, start: Start, time_out_s: float | None) -> Ended:
    task.out.parent.mkdir(parents=True, exist_ok=True)
    file = task.out.with_suffix(".task.json")
    task.write(file)
    try:
        return start((MODULE, str(file)), dict.fromkeys(THREADS, "1"), time_out_s)
    finally:
        file.unlink(missing_ok=True)


def run_task(task: Task) -> Receipt:
    """Fit, write the files, and last the receipt that says so; an error of the data is an answer as well.

    Raises:
        OSError: the disk; it may be tried again.
    """
    from addb_viewer.dataset.subject_files import write_subject_files  # noqa: PLC0415 (loads the solver)
    from annotations.review_errors import ReviewError  # noqa: PLC0415 (likewise)
    from solver.common.errors import SolverError  # noqa: PLC0415 (likewise)

    began = time.monotonic()
    try:
        made = write_subject_files(task)
    except (SolverError, ReviewError, ValueError, ArithmeticError, LookupError) as error:
        if isinstance(error.__cause__, OSError):
            raise error.__cause__ from error
        why = " ".join(str(error).split()) or type(error).__name__
        made = Receipt(task.key, failed=LeftOut("subject", task.who.subject_id, "fit_failed", why))
    receipt = replace(made, seconds=time.monotonic() - began, peak_MB=peak_memory_MB())
    write_receipt(receipt, task.out)
    return receipt


def main(words: Sequence[str]) -> int:
    """Do the task of a file."""
    end_with_parent()
    try:
        run_task(read_task(Path(words[0])))
    except OSError as error:
        sys.stderr.write(f"{error.filename or ''}: {error.strerror}\n")
        return DISK_FAILED
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
