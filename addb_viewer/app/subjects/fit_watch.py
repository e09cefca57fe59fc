"""Notices when another program, as `addb-viewer fit` in a terminal, replaces the fit."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

LOOK_EVERY = 2.0  # [s]


class FitWatch:
    """Looks at the time of a results folder's `fit.json`, which is written last and in one step."""

    def __init__(self, results: Path, changed: Callable[[], None], every: float = LOOK_EVERY) -> None:
        """Begin to look.

        Args:
            results: the folder.
            changed: called once for every new fit, from a thread of its own.
            every: [s] between two looks.
        """
        self._file, self._changed, self._every = results / "fit.json", changed, every
        self._lock = threading.Lock()
        self._known = self._written()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._look, name="watch of the fit", daemon=True)
        self._thread.start()

    @contextmanager
    def own_fit(self) -> Iterator[None]:
        """What is written within is known: the app itself puts a fit there."""
        with self._lock:
            try:
                yield
            finally:
                self._known = self._written()

    def close(self) -> None:
        """Look no more."""
        self._stop.set()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)

    def _look(self) -> None:
        while not self._stop.wait(self._every):
            with self._lock:
                now = self._written()
                new, self._known = now is not None and now != self._known, now
            if new:
                self._changed()

    def _written(self) -> int | None:
        try:
            return self._file.stat().st_mtime_ns
        except OSError:
            return None
