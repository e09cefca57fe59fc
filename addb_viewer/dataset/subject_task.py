"""One subject from its recordings to its files of the release: what a worker does.

`python -m addb_viewer.dataset.subject_task TASK.json` does it in a process of its own.
"""

import json
import os
import resource
import signal
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from addb_viewer.dataset.left_out import LeftOut
from addb_viewer.dataset.options import BuildOptions, options_from
from addb_viewer.dataset.receipts import Receipt, write_receipt
from addb_viewer.dataset.release_subject import ReleaseSubject

DISK_FAILED = 75  # exit code: try again


@dataclass(frozen=True)
class Task:
    """A subject to be fitted, and where its files go."""

    key: str  # SHA-256 of all that the files depend on
    place: Path  # of the subject: folder or .b3d file
    who: ReleaseSubject
    trials: tuple[str, ...]  # that are wanted
    options: BuildOptions
    out: Path  # folder of the files
    frames: int  # of all wanted trials

    def write(self, path: Path) -> None:
        """As JSON, for a process of its own."""
        plain = asdict(self) | {"place": str(self.place), "out": str(self.out)}
        path.write_text(json.dumps(plain), encoding="utf-8")


def read_task(path: Path) -> Task:
    """What `Task.write` wrote."""
    plain: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    who = plain["who"] | {"filled": tuple(plain["who"]["filled"])}
    return Task(
        key=plain["key"],
        place=Path(plain["place"]),
        who=ReleaseSubject(**who),
        trials=tuple(plain["trials"]),
        options=options_from(plain["options"]),
        out=Path(plain["out"]),
        frames=plain["frames"],
    )


def run_task(task: Task) -> Receipt:
    """Fit, write the files, and last the receipt that says so; an error of the data is an answer as well.

    Raises:
        OSError: the disk; it may be tried again.
    """
    from addb_viewer.dataset.subject_files import write_subject_files  # noqa: PLC0415 (loads the solver)
    from annotations.errors import ReviewError  # noqa: PLC0415 (likewise)
    from solver.errors import SolverError  # noqa: PLC0415 (likewise)

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
