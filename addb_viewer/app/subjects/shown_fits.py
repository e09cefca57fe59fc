"""Which fit of a subject is on the screen, which one it is compared with, and which new solves wait."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from addb_viewer.app.subjects.library import Library, library_of
from addb_viewer.jobs.stored_solves import (
    NEW,
    Solve,
    discard,
    keep,
    prune,
    stored_solves,
    waiting_solves,
)
from solver.common.errors import SolverError
from solver.fitting.results.store import has_fit

LOOK_EVERY = 2.0  # [s]


class ShownFits:
    """The fits of one subject; whoever changes them here tells the browsers."""

    def __init__(self, library: Library, came: Callable[[], None]) -> None:
        """Show the first solve that waits for a decision, also from before the app ended, else the kept fit.

        Args:
            library: the subject with its kept fit.
            came: called when another program has put a fit into the results folder.
        """
        self.subject, self.shown = library.subject, library
        self.compared: Library | None = None
        self.new: Solve | None = None  # on the screen, waiting to be kept or discarded
        self.behind: tuple[Solve, ...] = ()  # other people's solves that wait for the one on the screen
        self._lock = threading.RLock()
        prune(self.results)
        self._show_waiting()
        self._watch = FitWatch(self.results, came)

    @property
    def results(self) -> Path:
        """Where fit, diagnosis and decisions lie."""
        return self.shown.results

    def close(self) -> None:
        """Look for new fits no more."""
        self._watch.close()

    def keep(self, author: str) -> Solve:
        """Make the new solve the subject's fit; the next one that waits comes on the screen.

        Raises:
            SolverError: none waits.
        """
        with self._lock:
            solve = self._waiting()
            with self._watch.own_fit():
                keep(solve, self.results, self.subject.folder, author)
            self.new = None
            if waiting_solves(stored_solves(self.results)):
                self.shown = self._kept()
            else:
                self.shown.fit_folder = self.results
                self.shown.fit_time_ns = (self.results / "fit.json").stat().st_mtime_ns
            self._show_waiting()
        return solve

    def discard(self, author: str, number: int | None = None) -> Solve:
        """Go back to the kept fit; the next one that waits comes on the screen.

        Args:
            author: who does.
            number: of the solve that is meant; None: the one on the screen.

        Raises:
            SolverError: none waits, or another one.
        """
        with self._lock:
            solve = self._waiting()
            if number is not None and solve.number != number:
                raise SolverError(f"solve {number} does not wait any more")
            discard(solve, author)
            self.new = None
            self.shown, self.compared = self._kept(), None
            self._show_waiting()
        return solve

    def compare_with(self, solve: Solve | None) -> None:
        """Put another solve beside the one on the screen; None: the kept fit, beside a new one.

        Raises:
            ResultsError: it cannot be read.
        """
        other = self._kept() if solve is None else self._of(solve)
        with self._lock:
            self.compared = other if other.fit is not None else None

    def take_in(self, number: str) -> None:
        """A solve has come: on the screen, unless somebody else's waits there; kept where it is the first.

        Args:
            number: of its folder.
        """
        solve = next(s for s in stored_solves(self.results) if s.folder.name == number)
        with self._lock:
            if not has_fit(self.results):
                with self._watch.own_fit():
                    keep(solve, self.results, self.subject.folder)
                self.shown, self.compared = self._kept(), None
            elif self.new is None or self.new.by == solve.by:
                self._show_new(solve)
            for old in stored_solves(self.results):  # the same person's last one is the one that waits
                if old.state == NEW and old.by == solve.by and old.number < solve.number:
                    discard(old)
            shown = -1 if self.new is None else self.new.number
            waiting = waiting_solves(stored_solves(self.results))
            self.behind = tuple(other for other in waiting if other.number != shown)

    def take_in_elsewhere(self) -> bool:
        """Show a fit that another program has made, unless a new solve waits on the screen.

        Returns:
            Whether it is shown.

        Raises:
            SolverError: it cannot be read.
        """
        with self._lock:
            if self.new is None:
                self.shown, self.compared = self._kept(), None
            return self.new is None

    def _waiting(self) -> Solve:
        if self.new is None:
            raise SolverError("no new solve waits to be kept or discarded; G solves again")
        return self.new

    def _kept(self) -> Library:
        return library_of(self.subject, self.shown.results_folder)

    def _of(self, solve: Solve) -> Library:
        return library_of(self.subject, self.shown.results_folder, solve.folder)

    def _show_waiting(self) -> None:
        found = waiting_solves(stored_solves(self.results))
        if found:
            self._show_new(found[0])
        self.behind = found[1:]

    def _show_new(self, solve: Solve) -> None:
        library = self._of(solve)
        with self._lock:
            kept = self.shown if self.new is None else self.compared
            self.compared = kept if kept is not None and kept.fit is not None else None
            self.shown, self.new = library, solve


class FitWatch:
    """Notices when another program, as `addb-viewer fit` in a terminal, replaces the fit.

    It looks at the time of a results folder's `fit.json`, which is written last and in one step.
    """

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
