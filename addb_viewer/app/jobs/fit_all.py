"""Fits, or does something else to, many subjects: one at a time, and after people's own work."""

import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue

from addb_viewer.app.jobs.job_queue import Outcome, WorkerProcess
from solver.fitting.results.store import has_fit

WORKER: tuple[str, ...] = ("addb_viewer.app.workers", "fit")
Command = tuple[str, ...]  # module and arguments
STEPS = 20  # in which a fit's progress is told: each is a table for every page
LOOK_EVERY = 0.5  # [s] at how far it is, and at what people have asked for


@dataclass(frozen=True)
class Fitting:
    """How far all of it is."""

    running: bool = False
    by: str = ""  # who asked
    subject: str = ""  # at work; empty between two
    stage: str = ""
    fraction: float | None = None  # of this subject; None where it does not say
    waiting: tuple[str, ...] = ()
    fitted: int = 0
    failures: Mapping[str, str] = field(default_factory=dict)  # why, by subject
    warnings: Mapping[str, str] = field(default_factory=dict)  # likewise of what came
    held_up: bool = False  # by what people have asked for
    seconds: float = 0.0  # since it began

    @property
    def total(self) -> int:
        """How many subjects it is about."""
        return self.fitted + len(self.failures) + len(self.waiting) + bool(self.subject)

    @property
    def seconds_left(self) -> float | None:
        """By how long the others took; None before the first has ended."""
        ended = self.fitted + len(self.failures)
        if not ended or not self.running:
            return None
        present = self.fraction or 0.0
        return self.seconds / (ended + present) * (self.total - ended - present)


class FitAll:
    """Works through a list of subjects in a thread of its own. What fails is told and stops nothing."""

    def __init__(
        self,
        places: Callable[[str], tuple[Path, Path]],
        wanted: Callable[[], bool],
        taken: Callable[[str], bool],
        changed: Callable[[str], None],
        command: Callable[[Path, Path], Command] | None = None,
        *,
        takes_turn: bool = False,
    ) -> None:
        """Nothing is at work yet.

        Args:
            places: what is fitted and its results folder, by the subject's name.
            wanted: whether anything is at work or waits that a person has asked for.
            taken: whether somebody solves this subject; it is then left to them.
            changed: told about every step, with the subject that has ended; empty: none has.
            command: what is done to what, with its results folder; None: a first fit, where there is none.
            takes_turn: as for `Task`.
        """
        self._command, self._takes_turn = command, takes_turn
        self._places, self._wanted, self._taken, self._changed = places, wanted, taken, changed
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._state, self._began = Fitting(), 0.0

    @property
    def state(self) -> Fitting:
        """How far it is now."""
        with self._lock:
            state = self._state
            return replace(state, seconds=time.monotonic() - self._began) if state.running else state

    def start(self, names: Sequence[str], by: str) -> int:
        """Fit these too, after those that wait; what failed is tried again.

        Args:
            names: of subjects without a fit.
            by: who asks.

        Returns:
            How many have been added.
        """
        thread = self._thread
        if thread is not None and self._stop.is_set():  # cancelled just now: it ends soon
            thread.join()
        with self._lock:
            state = self._state
            new = [name for name in names if name not in (*state.waiting, state.subject)]
            if new and not state.running:
                state, self._began = Fitting(running=True, by=by), time.monotonic()
                self._stop.clear()
                self._thread = threading.Thread(target=self._work, name="fits of all", daemon=True)
                self._thread.start()
            self._state = replace(
                state,
                waiting=(*state.waiting, *new),
                failures={name: why for name, why in state.failures.items() if name not in new},
                warnings={name: why for name, why in state.warnings.items() if name not in new},
            )
        self._changed("")
        return len(new)

    def cancel(self) -> None:
        """End the present fit, which leaves nothing behind, and forget the waiting; fits that came stay."""
        with self._lock:
            self._state = replace(self._state, waiting=())
        self._stop.set()

    def close(self) -> None:
        """Cancel, and wait for the end."""
        self.cancel()
        thread = self._thread
        if thread is not None:
            thread.join()

    def _work(self) -> None:
        while (name := self._next()) is not None:
            folder, results = self._places(name)
            fitted = self._command is None and has_fit(results)
            outcome = None if fitted else self._fit(name, folder, results)
            with self._lock:
                state = replace(self._state, subject="", stage="", fraction=None)
                why = "" if outcome is None else outcome.error.replace(f"{folder.absolute()}{os.sep}", "")
                if outcome is None or outcome.succeeded:
                    warned = {name: why} if why else {}
                    state = replace(state, fitted=state.fitted + 1, warnings={**state.warnings, **warned})
                elif not outcome.cancelled:
                    state = replace(state, failures={**state.failures, name: why})
                self._state = state
            self._changed(name)
        self._changed("")

    def _next(self) -> str | None:
        """The next subject, once nothing is at work that a person waits for; None: there is none."""
        while True:
            held_up = self._wanted()
            with self._lock:
                state = self._state
                if not state.waiting or self._stop.is_set():
                    took = time.monotonic() - self._began
                    self._state = replace(state, running=False, waiting=(), held_up=False, seconds=took)
                    return None
                if not held_up:
                    name, *others = state.waiting
                    self._state = replace(state, subject=name, waiting=tuple(others), held_up=False)
                    return name
                turned, self._state = not state.held_up, replace(state, held_up=True)
            if turned:
                self._changed("")
            self._stop.wait(LOOK_EVERY)

    def _fit(self, name: str, folder: Path, results: Path) -> Outcome:
        outcomes = SimpleQueue[Outcome]()
        work = WorkerProcess(self._on_progress, outcomes.put)
        work.start(self._command_of(folder.absolute(), results.absolute()), takes_turn=self._takes_turn)
        shown = None
        while True:
            try:
                return outcomes.get(timeout=LOOK_EVERY)
            except Empty:
                if self._stop.is_set() or self._taken(name):
                    work.cancel()
                    return outcomes.get()
            now = self.state
            if (now.stage, now.fraction) != shown:
                shown = now.stage, now.fraction
                self._changed("")

    def _command_of(self, folder: Path, results: Path) -> Command:
        if self._command is None:
            return *WORKER, str(folder), str(results)
        return self._command(folder, results)

    def _on_progress(self, stage: str, fraction: float) -> None:
        share = round(STEPS * fraction) / STEPS if fraction >= 0 else None
        with self._lock:
            self._state = replace(self._state, stage=stage, fraction=share)
