"""What is done to many subjects at once from the queue: fits, diagnoses, exports; who is to review them."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from addb_viewer.app.jobs.fit_all import Command, FitAll, Fitting
from addb_viewer.app.jobs.job_queue import PROGRAM
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.app.subjects.shared_subject import DIAGNOSE_WORKER
from addb_viewer.jobs.review_store import open_log
from annotations.work import Assign, WorkEvent
from solver.common.errors import SolverError

SHOW_EVERY = 2.0  # [s] while many are assigned: what has been recorded by then
FIT, DIAGNOSE, EXPORT = "fit", "diagnose", "export"


class Batches:
    """Works for whoever has selected trials; one subject at a time, after what people wait for."""

    def __init__(self, trials: TrialQueue) -> None:
        self._trials, self._format = trials, ""
        self._lock = threading.Lock()
        places, fits = trials.subjects.folders, trials.fit_all
        self._diagnoses = FitAll(
            places,
            lambda: self._busy(fits),
            trials.is_solved,
            trials.step_of_batch,
            _diagnosis,
            takes_turn=True,
        )
        self._exports = FitAll(
            places,
            lambda: self._busy(fits, self._diagnoses),
            lambda name: False,
            trials.step_of_batch,
            self._export,
        )
        self.by_kind = {FIT: fits, DIAGNOSE: self._diagnoses, EXPORT: self._exports}

    def close(self) -> None:
        """End what is at work."""
        for batch in self.by_kind.values():
            batch.close()

    def cancel(self) -> None:
        """End what is at work, and forget what waits."""
        for batch in self.by_kind.values():
            batch.cancel()

    @property
    def states(self) -> dict[str, Fitting]:
        """How far each kind of work is."""
        return {kind: batch.state for kind, batch in self.by_kind.items()}

    def start(self, kind: str, places: Sequence[TrialPlace], by: str, to: str = "") -> int:
        """Do it to the subjects of these trials.

        Args:
            kind: fit, diagnose or export.
            places: selected trials.
            by: who asks.
            to: format of an export.

        Returns:
            To how many subjects.

        Raises:
            SolverError: none of them needs it, or has a fit yet, or there is no such format.
        """
        wanted = {subject for subject, _ in places}
        unfitted = set(self._trials.unfitted())
        known = [name for name in self._trials.subjects.root.names if name in wanted]
        names = [name for name in known if (name in unfitted) is (kind == FIT)]
        if not names:
            raise SolverError("all of them have a fit" if kind == FIT else "none of them has a fit yet")
        if kind == EXPORT:
            if to not in formats():
                raise SolverError(f"no format '{to}'; formats: {', '.join(formats())}")
            self._format = to
        return self.by_kind[kind].start(names, by)

    def assign(
        self, places: Sequence[TrialPlace], person: str, by: str, told: Callable[[], bool] = lambda: True
    ) -> None:
        """Say who is to review these trials; empty: nobody in particular.

        Args:
            places: selected trials.
            person: whose they are to be.
            by: who says so.
            told: asked between two subjects whether to go on.

        Raises:
            ReviewError: it cannot be recorded.
        """
        event = Assign(person.strip())
        by_subject: dict[str, list[str]] = {}
        known = {(row.subject, row.trial) for row in self._trials.rows() if row.trial}
        for subject, trial in dict.fromkeys(places):
            if (subject, trial) in known:
                by_subject.setdefault(subject, []).append(trial)
        recorded, shown_at = list[str](), time.monotonic()
        try:
            for subject, names in by_subject.items():
                if not told():
                    return
                self._record(subject, names, event, by)
                recorded.append(subject)
                if time.monotonic() - shown_at > SHOW_EVERY:
                    self._trials.refresh_all(recorded)
                    recorded, shown_at = [], time.monotonic()
        finally:
            self._trials.refresh_all(recorded)

    def say(self, subject: str, trials: Sequence[str], event: WorkEvent, by: str) -> None:
        """Record who is to review trials of a subject, or a comment on one.

        Raises:
            ReviewError: it cannot be recorded.
        """
        self._record(subject, trials, event, by)
        self._trials.refresh(subject)

    def _record(self, subject: str, trials: Sequence[str], event: WorkEvent, by: str) -> None:
        with self._lock, open_log(self._trials.subjects.folders(subject)[0]) as log:
            log.work.append(trials, event, by)

    def _busy(self, *others: FitAll) -> bool:
        return self._trials.is_wanted() or any(other.state.running for other in others)

    def _export(self, folder: Path, results: Path) -> Command:
        return PROGRAM, "export", str(folder), "--to", self._format, "--out", str(results)


def formats() -> list[str]:
    """Of an export."""
    from addb_viewer.jobs.exporting import Format  # noqa: PLC0415 (slow to load)

    return [each.value for each in Format]


def _diagnosis(folder: Path, results: Path) -> Command:
    return *DIAGNOSE_WORKER, str(folder), str(results)
