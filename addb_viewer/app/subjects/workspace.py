"""All subjects of the opened root: those that somebody looks at, or just did, are in memory."""

import itertools
import threading
from collections.abc import Callable
from pathlib import Path

from addb_viewer.app.jobs.fit_all import FitAll
from addb_viewer.app.jobs.progress_html import in_words
from addb_viewer.app.queue.fit_all_html import words_of_rows
from addb_viewer.app.queue.rows import Row, order, subject_rows
from addb_viewer.app.queue.watch import QueueWatch, Signature, signature
from addb_viewer.app.subjects.library import Library, library_of
from addb_viewer.app.subjects.people import People
from addb_viewer.app.subjects.root_folder import RootFolder
from addb_viewer.app.subjects.shared_subject import SubjectRoom
from addb_viewer.recordings.recording import file_of
from solver.capture.capture import Subject
from solver.errors import ResultsError
from solver.results.store import default_folder

EMPTY_ROOMS = 1  # subjects kept in memory that nobody looks at: a page that is reloaded comes back at once


class House:
    """Opens rooms when they are entered and closes those that stand empty."""

    def __init__(self, root: RootFolder, results: Path | None = None, log: Path | None = None) -> None:
        """Open nothing yet.

        Args:
            root: the subjects.
            results: folder of the fit; inside the subject's folder by default.
            log: file that the session is written down in, one a subject where there are several; None: only
                where somebody asks for it on the page.

        Raises:
            ResultsError: the log's folder is not there.
        """
        if log is not None and not log.absolute().parent.is_dir():
            raise ResultsError(f"{log}: no such folder; name the log in one that is there")
        self.root, self._results, self._log = root, results, log
        self.people = People()
        self._subject: Callable[[str], Subject] = root.subject
        self._lock = threading.RLock()
        self._rooms: dict[str, SubjectRoom] = {}  # in the order in which they were last entered
        self._rows: list[Row] = []
        self._seen: dict[str, int] = {}  # by subject, the revision of its review that the rows know
        self._signatures: dict[str, Signature] = {}  # by subject, of what the rows were read from
        self._watch: QueueWatch | None = None
        self.fit_all = FitAll(self._places, self._wanted, self._is_solved, self._fitting_changed)

    @classmethod
    def of(cls, library: Library) -> "House":
        """A house of one room, already furnished."""
        folder = library.subject.folder
        house = cls(RootFolder(folder.resolve(), (".",)), library.results_folder)
        house._subject = lambda name: library.subject
        house._rooms["."] = SubjectRoom(".", library, house.people)
        return house

    @property
    def several(self) -> bool:
        """Whether there are several subjects."""
        return len(self.root.names) > 1

    @property
    def rooms(self) -> tuple[SubjectRoom, ...]:
        """Those in memory."""
        with self._lock:
            return tuple(self._rooms.values())

    def room(self, name: str) -> SubjectRoom:
        """A subject, loaded when it is entered first.

        Raises:
            CaptureError, ResultsError: it, or its fit, cannot be read.
        """
        with self._lock:
            room = self._rooms.pop(name, None)
            if room is None:
                room = SubjectRoom(name, library_of(self._subject(name), self._results), self.people)
                if self._log is not None:
                    room.begin_log(self._log_file(name, self._log))
            self._rooms[name] = room
        return room

    def tidy(self) -> None:
        """Close the rooms that nobody has been in for longest, but for the last."""
        with self._lock:
            empty = [name for name, room in self._rooms.items() if not room.visited and not room.bench.busy]
            gone = [self._rooms.pop(name) for name in empty[: max(0, len(empty) - EMPTY_ROOMS)]]
        for room in gone:
            room.close()

    def rows(self, *, anew: bool = False) -> list[Row]:
        """The queue; read from the disk once, and again when asked for."""
        with self._lock:
            if anew or not self._rows:
                rows = [row for name in self.root.names for row in self._rows_of(name)]
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
            before = self.rows()
            others = [row for row in before if row.subject != subject]
            self._rows = sorted([*others, *self._rows_of(subject)], key=order)
            now = list(self._rows)
        if now != before:
            self.people.queue_changed()
        return now

    def watch(self) -> None:
        """Notice from now on what other programs do to any subject."""
        with self._lock:
            if self._watch is None:
                self._watch = QueueWatch(self.root.names, self._look_at)

    def unfitted(self) -> list[str]:
        """Subjects that can be opened and have no fit, in the order of their names."""
        rows = self.rows()
        others = {row.subject for row in rows if row.error or row.figures is not None}
        return [name for name in self.root.names if name not in others]

    def at_work(self) -> dict[str, str]:
        """What is at work, in words as safe HTML, by subject."""
        found = ((room.name, room.bench.progress) for room in self.rooms)
        asked = {name: in_words(progress.task) for name, progress in found if progress is not None}
        return words_of_rows(self.fit_all.state) | asked

    def _places(self, name: str) -> tuple[Path, Path]:
        folder = self.root.path / name
        return folder, self._results or default_folder(folder)

    def _wanted(self) -> bool:
        return any(room.bench.wanted for room in self.rooms)

    def _is_solved(self, name: str) -> bool:
        return any(room.solving for room in self.rooms if room.name == name)

    def _fitting_changed(self, ended: str) -> None:
        if ended:
            self.refresh(ended)
        self.people.queue_changed()

    def _look_at(self, name: str) -> None:
        with self._lock:
            known = self._signatures.get(name)
        if known is not None and known != self._signature(name):
            self.refresh(name)

    def _signature(self, name: str) -> Signature:
        in_memory = any(room.name == name for room in self.rooms)  # it looks at its review itself
        return signature(*self._places(name), review=not in_memory)

    def _log_file(self, name: str, wished: Path) -> Path:
        """A file that is not there yet: what was logged before is never written over."""
        stem = f"{wished.stem} {file_of(name)}" if self.several else wished.stem
        names = (stem if k == 1 else f"{stem} {k}" for k in itertools.count(1))
        files = (wished.with_name(each + (wished.suffix or ".mcap")) for each in names)
        return next(file for file in files if not file.exists())

    def _rows_of(self, name: str) -> list[Row]:
        self._signatures[name] = self._signature(name)  # before it is read: what is written meanwhile is new
        try:
            return subject_rows(name, self._subject(name), self._results)
        except Exception as error:  # one broken subject is a row that says so, and hides no other
            return [Row(name, "", error=str(error) or type(error).__name__)]

    def close(self) -> None:
        """End what is at work, and close all rooms."""
        self.fit_all.close()
        with self._lock:
            rooms, self._rooms = list(self._rooms.values()), {}
            watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()
        for room in rooms:
            room.close()
