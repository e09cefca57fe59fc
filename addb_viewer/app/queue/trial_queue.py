"""The queue of all trials as every browser sees it, kept up to date; and the fits of all that have none."""

import html
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from addb_viewer.app.jobs.fit_all import FitAll
from addb_viewer.app.queue.queue_html import words_of_rows
from addb_viewer.app.queue.queue_rows import Row, order, subject_rows
from addb_viewer.app.subjects.library import Library
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.jobs.kept_diagnosis import FILE as DIAGNOSIS
from addb_viewer.jobs.review_store import FILE, open_log, store_url
from addb_viewer.jobs.stored_solves import FOLDER, MADE
from annotations.review_errors import ReviewError

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

    def __init__(
        self, names: Callable[[], Sequence[str]], look: Callable[[str], None], every: float = LOOK_EVERY
    ) -> None:
        """Begin to look.

        Args:
            names: of the subjects, as they are known then.
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
            for name in self._names():
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


AHEAD = 2  # subjects that are fitted in the background before somebody comes to them


class TrialQueue:
    """Reads the rows of each subject from the disk, and again where something changed."""

    def __init__(self, subjects: OpenSubjects) -> None:
        """Read nothing yet."""
        self.subjects, self.people = subjects, subjects.people
        self.orders: dict[str, tuple[TrialPlace, ...]] = {}  # by browser, what its page of the queue shows
        self._lock = threading.RLock()
        self._rows: list[Row] = []
        self._seen: dict[str, int] = {}  # by subject, the revision of its review that the rows know
        self._signatures: dict[str, Signature] = {}  # by subject, of what the rows were read from
        self._watch: QueueWatch | None = None
        self._given_up: set[str] = set()  # subjects whose fit failed or was cancelled
        self.fit_all = FitAll(subjects.folders, self.is_wanted, self.is_solved, self.step_of_batch)

    @classmethod
    def of(cls, library: Library) -> "TrialQueue":
        """Of a single subject, loaded already."""
        return cls(OpenSubjects.of(library))

    def rows(self, *, anew: bool = False) -> list[Row]:
        """All trials in order; read from the disk once, and again when asked for."""
        with self._lock:
            if anew:
                self.subjects.find_new()
            if anew or not self._rows:
                rows = [row for name in self.subjects.root.names for row in self._rows_of(name)]
                self._rows = sorted(rows, key=order)
            return list(self._rows)

    def refresh(self, subject: str, revision: int | None = None) -> list[Row]:
        """The queue with the rows of one subject read anew.

        Args:
            subject: which.
            revision: of its review; nothing is read where that has been done for it. None: whatever it is.
        """
        with self._lock:
            if revision is not None and revision <= self._seen.get(subject, -1):
                return self.rows()
            if revision is not None:
                self._seen[subject] = revision
        return self.refresh_all([subject])

    def refresh_all(self, subjects: Sequence[str]) -> list[Row]:
        """The queue with the rows of these subjects read anew; pages hear of it once."""
        with self._lock:
            before, wanted = self.rows(), set(subjects)
            others = [row for row in before if row.subject not in wanted]
            new = [row for subject in subjects for row in self._rows_of(subject)]
            self._rows = sorted([*others, *new], key=order)
            now = list(self._rows)
        if now != before:
            self.people.queue_changed()
        return now

    def watch(self) -> None:
        """Notice from now on what other programs do to any subject."""
        with self._lock:
            if self._watch is None:
                self._watch = QueueWatch(lambda: self.subjects.root.names, self._look_at)

    def unfitted(self) -> list[str]:
        """Subjects that can be opened and have no fit, in the order of their names."""
        rows = self.rows()
        others = {row.subject for row in rows if row.error or row.figures is not None}
        return [name for name in self.subjects.root.names if name not in others]

    def fit_ahead(self, names: Sequence[str], by: str) -> None:
        """Fit the first of these in the background, after all that people ask for.

        Args:
            names: of subjects, in the order in which they are wanted.
            by: whose trials they will be.
        """
        unfitted = set(self.unfitted()) - self._given_up if self.subjects.several else ()
        ahead = [name for name in names if name in unfitted][:AHEAD]
        if ahead and not self.fit_all.state.running:
            self.fit_all.start(ahead, by)

    def is_being_fitted(self, name: str) -> bool:
        """Whether a subject's fit is at work in the background, or waits its turn."""
        state = self.fit_all.state
        return name == state.subject or name in state.waiting

    def cancel_fits(self) -> None:
        """End the fits in the background; none of them begins again unasked."""
        state = self.fit_all.state
        self._given_up |= {state.subject, *state.waiting}
        self.fit_all.cancel()

    def at_work(self) -> dict[str, str]:
        """What is at work, in words as safe HTML, by subject."""
        found = ((shared.name, shared.jobs.progress) for shared in self.subjects.loaded)
        asked = {name: html.escape(progress.task.words) for name, progress in found if progress is not None}
        return words_of_rows(self.fit_all.state) | asked

    def tasks(self) -> dict[str, str]:
        """What somebody has asked for and is at work, in plain words, by subject."""
        found = ((shared.name, shared.jobs.progress) for shared in self.subjects.loaded)
        return {name: progress.task.words for name, progress in found if progress is not None}

    def close(self) -> None:
        """End the fits and the watch, and close all subjects."""
        self.fit_all.close()
        with self._lock:
            watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()
        self.subjects.close()

    def is_wanted(self) -> bool:
        """Whether anything is at work or waits that a person has asked for."""
        return any(shared.jobs.busy for shared in self.subjects.loaded)

    def is_solved(self, name: str) -> bool:
        """Whether somebody solves a subject, or waits for it."""
        return any(shared.solving for shared in self.subjects.loaded if shared.name == name)

    def step_of_batch(self, ended: str) -> None:
        """Work on many subjects has gone on.

        Args:
            ended: the subject that has ended; empty: none has.
        """
        self._given_up |= self.fit_all.state.failures.keys()
        if ended:
            self.refresh(ended)
        self.people.queue_changed()

    def _look_at(self, name: str) -> None:
        with self._lock:
            known = self._signatures.get(name)
        if known is not None and known != self._signature(name):
            self.refresh(name)

    def _signature(self, name: str) -> Signature:
        in_memory = any(shared.name == name for shared in self.subjects.loaded)  # looks at its review itself
        return signature(*self.subjects.folders(name), review=not in_memory)

    def _rows_of(self, name: str) -> list[Row]:
        self._signatures[name] = self._signature(name)  # before it is read: what is written meanwhile is new
        try:
            return subject_rows(name, self.subjects.read(name), self.subjects.results)
        except Exception as error:  # one broken subject is a row that says so, and hides no other
            return [Row(name, "", error=str(error) or type(error).__name__)]
