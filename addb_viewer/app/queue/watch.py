"""Notices what other programs do to any subject of the root: fits, new solves, edits of its review."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from addb_viewer.jobs.kept_diagnosis import FILE as DIAGNOSIS
from addb_viewer.jobs.review_store import FILE, open_log, store_url
from addb_viewer.jobs.stored_solves import FOLDER, MADE
from annotations.errors import ReviewError

LOOK_EVERY = 2.0  # [s] between two looks, at least
SHARE = (
    0.1  # of the time, at most, is spent looking: a root of a thousand subjects on a slow share takes longer
)

Signature = tuple[object, ...]


def signature(subject_folder: Path, results: Path, *, review: bool) -> Signature:
    """When what the queue shows of a subject was written last; equal as long as nothing changed.

    Of a review in a shared database, its revisions: two short queries.

    Args:
        subject_folder: of the recordings.
        results: folder of the fit.
        review: whether to look at the review.
    """
    files = [results / "fit.json", results / DIAGNOSIS, *sorted((results / FOLDER).glob(f"*/{MADE}"))]
    if review:
        files += [subject_folder / FILE, subject_folder / f"{FILE}-wal"]
    shared = (_revision(subject_folder),) if review and store_url() else ()
    return (*shared, *((str(file), _written(file)) for file in files))


class QueueWatch:
    """Looks at all subjects in turn, from a thread of its own."""

    def __init__(self, names: Sequence[str], look: Callable[[str], None], every: float = LOOK_EVERY) -> None:
        """Begin to look.

        Args:
            names: of the subjects.
            look: at one of them; what it raises is its own affair.
            every: [s] between two looks.
        """
        self._names, self._look_at, self._every = names, look, every
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._look, name="watch of the queue", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Look no more."""
        self._stop.set()
        self._thread.join(timeout=5.0)

    def _look(self) -> None:
        pause = self._every
        while not self._stop.wait(pause):
            began = time.monotonic()
            for name in self._names:
                if self._stop.is_set():
                    return
                self._look_at(name)
            pause = max(self._every, (time.monotonic() - began) / SHARE)


def _revision(subject_folder: Path) -> tuple[int, int] | str:
    """Of the review in the shared database; what is wrong where it does not answer."""
    try:
        with open_log(subject_folder) as log:
            return log.revision(), log.work.revision()
    except ReviewError as error:
        return str(error)


def _written(file: Path) -> tuple[int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
