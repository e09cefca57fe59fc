"""The opened folder's subjects: those that somebody looks at, or just did, are in memory."""

import contextlib
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

from addb_viewer.app.subjects.library import Library, library_of
from addb_viewer.app.subjects.people import People
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.jobs.root_folder import RootFolder, open_root
from solver.capture.capture import Subject
from solver.common.errors import CaptureError
from solver.common.memory_release import release_memory
from solver.fitting.results.store import default_folder

AHEAD_AFTER_S = 1.0  # the page that has just been shown comes first
MOST_AHEAD = 4  # subjects that are read and nobody has come to yet
OLDEST_AHEAD_S = 600.0  # what was read earlier is read again: its files may be others
UNWATCHED = 1  # subjects kept in memory that nobody looks at: a page that is reloaded comes back at once


class OpenSubjects:
    """Loads subjects when somebody looks at them, and closes those that nobody does."""

    def __init__(self, root: RootFolder, results: Path | None = None) -> None:
        """Load nothing yet.

        Args:
            root: the opened folder.
            results: folder of the fit; inside the subject's folder by default.
        """
        self.root, self.results = root, results
        self.people = People()
        self.read: Callable[[str], Subject] = root.subject
        self._lock = threading.RLock()
        self._loaded: dict[str, SharedSubject] = {}  # in the order in which somebody last went to them
        self._closed = threading.Event()
        self._ahead: OrderedDict[str, tuple[Library, float]] = OrderedDict()  # read, and when

    @classmethod
    def of(cls, library: Library) -> "OpenSubjects":
        """A single subject, loaded already."""
        folder = library.subject.folder
        subjects = cls(RootFolder(folder.resolve(), (".",)), library.results_folder)
        subjects.read = lambda name: library.subject
        subjects._loaded["."] = SharedSubject(".", library, subjects.people)
        return subjects

    def find_new(self) -> None:
        """Take in subjects that came into the opened folder since; those that have gone are left out."""
        with contextlib.suppress(CaptureError):  # nothing can be read there now: what is known stays
            self.root = open_root(self.root.path)
            self.read = self.root.subject

    @property
    def several(self) -> bool:
        """Whether there are several subjects."""
        return len(self.root.names) > 1

    @property
    def loaded(self) -> tuple[SharedSubject, ...]:
        """Those in memory."""
        with self._lock:
            return tuple(self._loaded.values())

    def subject(self, name: str) -> SharedSubject:
        """A subject, loaded when somebody looks at it first.

        Raises:
            CaptureError, ResultsError: it, or its fit, cannot be read.
        """
        with self._lock:
            shared = self._loaded.pop(name, None)
            if shared is None:
                library = self._read_already(name) or library_of(self.read(name), self.results)
                shared = SharedSubject(name, library, self.people)
            self._loaded[name] = shared
        return shared

    def read_ahead(self, name: str, trial: str) -> None:
        """Have a subject and one of its trials read in the background: whoever goes there does not wait.

        What is wrong with them is told to whoever goes there.
        """
        threading.Thread(
            target=self._read_ahead, args=(name, trial), name=f"reading {name} ahead", daemon=True
        ).start()

    def _read_ahead(self, name: str, trial: str) -> None:
        if self._closed.wait(AHEAD_AFTER_S):
            return
        with self._lock:
            loaded = self._loaded.get(name)
            library = self._read_already(name) if loaded is None else loaded.fits.shown
        try:
            library = library or library_of(self.read(name), self.results)
            library.replay(trial)
            library.figures(trial)
        except Exception:  # told to whoever goes there
            return
        with self._lock:
            if name not in self._loaded:
                self._ahead[name] = library, time.monotonic()
                while len(self._ahead) > MOST_AHEAD:
                    self._ahead.popitem(last=False)

    def _read_already(self, name: str) -> Library | None:
        library, read_at = self._ahead.pop(name, (None, 0.0))
        is_old = library is None or not library.is_current or time.monotonic() - read_at > OLDEST_AHEAD_S
        return None if is_old else library

    def folders(self, name: str) -> tuple[Path, Path]:
        """Of a subject's recordings, and of its results."""
        folder = self.root.path / name
        return folder, self.results or default_folder(folder)

    def close_unwatched(self) -> None:
        """Close the subjects at rest that nobody has looked at for longest, but for the last one."""
        with self._lock:
            resting = [
                name for name, shared in self._loaded.items() if not (shared.is_watched or shared.jobs.busy)
            ]
            gone = [self._loaded.pop(name) for name in resting[:-UNWATCHED]]
        for shared in gone:
            shared.close()
        if gone:
            threading.Thread(target=release_memory, name="giving memory back", daemon=True).start()

    def close(self) -> None:
        """Close all."""
        self._closed.set()
        with self._lock:
            loaded, self._loaded = list(self._loaded.values()), {}
        for shared in loaded:
            shared.close()
