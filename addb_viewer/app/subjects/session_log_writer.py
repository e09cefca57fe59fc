"""What happens to a subject while the app runs, written into its session log by a thread of its own."""

import contextlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from addb_viewer.app.jobs.job_queue import Task, TaskProgress
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.subjects.library import Library
from addb_viewer.jobs.kept_diagnosis import kept
from annotations.events import Edit
from solver.common.errors import SolverError

if TYPE_CHECKING:
    from addb_viewer.recordings.session_log import SessionLog

FitKey = tuple[Path | None, int]


class SessionLogWriter:
    """Writes down what it is told; nobody who tells it waits for the disk."""

    def __init__(
        self, log: "SessionLog", edits: Callable[[int], Sequence[Edit]], failed: Callable[[Exception], None]
    ) -> None:
        """Begin with all edits that there are.

        Args:
            log: open.
            edits: those after the one of a number, all after 0.
            failed: told once, when nothing can be written any more.
        """
        self.log, self._edits, self._told_failure = log, edits, failed
        self._hand = ThreadPoolExecutor(max_workers=1, thread_name_prefix="session log")
        self._last_edit = 0
        self._numbers: dict[FitKey, int] = {}
        self._written: set[tuple[FitKey, str]] = set()
        self._shown: FitKey | None = None
        self._stopped = False
        self._do(self._write_edits)

    @property
    def file(self) -> Path:
        """Where it is written."""
        return self.log.file

    def opened(self, trial: str, library: Library, other: Library | None = None) -> None:
        """A trial is on the screen of somebody; what it shows is written once.

        Args:
            trial: its name.
            library: with the fit that is shown, if any.
            other: with the fit that it is compared with.
        """
        self._do(lambda: self._write_trial(trial, library, other))

    def edited(self) -> None:
        """Somebody recorded edits."""
        self._do(self._write_edits)

    def progressed(self, progress: TaskProgress) -> None:
        """Something is at work."""
        if progress.fraction is not None:
            stage, fraction, seconds = progress.stage, progress.fraction, progress.seconds
            self._do(lambda: self.log.progress(stage, fraction, seconds=seconds))

    def ended(self, task: Task, outcome: Outcome) -> None:
        """It is not any more."""
        how = "was cancelled" if outcome.cancelled else "is done"
        if not outcome.succeeded and not outcome.cancelled:
            how = f"failed: {outcome.error}"
        by = f" (for {task.by})" if task.by else ""
        self.note(f"{task.doing} {how}{by}", is_warning=not outcome.succeeded and not outcome.cancelled)

    def diagnosed(self, results: Path) -> None:
        """A diagnosis was kept in a results folder."""
        self._do(lambda: self._write_diagnosis(results))

    def note(self, text: str, *, is_warning: bool = False) -> None:
        """What people were told."""
        self._do(lambda: self.log.note(text, is_warning=is_warning))

    def close(self) -> None:
        """Write what still waits, and the index."""
        self._hand.shutdown(wait=True)
        self.log.close()

    def _write_edits(self) -> None:
        for edit in self._edits(self._last_edit):
            self.log.edit(edit)
            self._last_edit = edit.number

    def _write_trial(self, trial: str, library: Library, other: Library | None) -> None:
        fit, key = library.fit, (library.fit_folder, library.fit_time_ns)
        if (key, trial) in self._written:
            self._say_which(key)
            return
        self.log.capture(library.capture(trial))
        fitted = fit is not None and any(each.capture.name == trial for each in fit.trials)
        if fit is not None and fitted:
            self._numbers[key] = self.log.fit(
                fit,
                trials=[trial],
                previous=None if other is None else other.fit,
                meshes=library.meshes,
                number=self._numbers.get(key),
            )
            self._say_which(key)
        self._written.add((key, trial))

    def _say_which(self, key: FitKey) -> None:
        if key != self._shown and key in self._numbers:
            self.log.note(f"on the screen: fit-{self._numbers[key]}")
            self._shown = key

    def _write_diagnosis(self, results: Path) -> None:
        found = kept(results)
        if found is not None:
            self.log.diagnosis(found[0])

    def _do(self, write: Callable[[], None]) -> None:
        with contextlib.suppress(RuntimeError):  # it was closed just now
            self._hand.submit(self._guarded, write)

    def _guarded(self, write: Callable[[], None]) -> None:
        try:
            write()
        except Exception as error:  # whatever it is, the session goes on, and somebody is told
            self._stop(error)
        if self.log.trouble:
            self._stop(SolverError(self.log.trouble))

    def _stop(self, error: Exception) -> None:
        if not self._stopped:
            self._stopped = True
            self._told_failure(error)
