"""Asks the warm worker what the residual would be with other flags."""

import json
import threading
from pathlib import Path
from typing import Any

from addb_viewer.jobs.processes import OwnProcess
from solver.common.errors import SolverError
from solver.contact.force_review import ForceReview, as_plain

NICE = 3  # a person waits for the answer: after the page, before a solve
WORKER = ("addb_viewer.app.workers", "what_if")


class WhatIf:
    """One worker a subject; it keeps the fit, and what it has answered, in memory until `close`."""

    def __init__(self, subject_folder: Path, results: Path) -> None:
        """Start nothing yet.

        Args:
            subject_folder: of the recordings.
            results: with the kept fit, at which the search begins, and what people accepted.
        """
        self._arguments = tuple(str(Path(place).absolute()) for place in (subject_folder, results))
        self._lock = threading.Lock()
        self._process: OwnProcess | None = None
        self._closed = False

    def warm(self) -> None:
        """Start the worker, so that the first answer comes soon; never waits."""
        if self._lock.acquire(blocking=False):  # else it is at work already
            try:
                self._alive()
            finally:
                self._lock.release()

    @property
    def is_warm(self) -> bool:
        """Whether the worker has been started, so that an answer costs no more than the solver's time."""
        return self._process is not None and self._process.popen.poll() is None

    def ask(self, trial: str, present: ForceReview | None, instead: ForceReview) -> dict[str, Any]:
        """The figures of a trial with the present decisions and with others.

        Args:
            trial: its name.
            present: what people say about its forces; None: the kept fit.
            instead: what they would say.

        Raises:
            SolverError: it cannot be computed; why.
        """
        now = None if present is None else as_plain(present)
        question = json.dumps({"trial": trial, "present": now, "instead": as_plain(instead)})
        with self._lock:
            return _asked(self._alive(), question)

    def close(self) -> None:
        """End the worker: what it knows is of no use any more."""
        process, self._process, self._closed = self._process, None, True
        if process is None:
            return
        process.cancel()
        process.wait()

    def _alive(self) -> OwnProcess:
        if self._closed:
            raise SolverError("the fit has just been replaced; ask again")
        if self._process is None or self._process.popen.poll() is not None:
            self._process = OwnProcess((*WORKER, *self._arguments), nice=NICE)
        return self._process


def _asked(process: OwnProcess, question: str) -> dict[str, Any]:
    assert process.popen.stdin is not None
    assert process.popen.stdout is not None
    lines = process.popen.stdout
    try:
        process.popen.stdin.write(question + "\n")
        process.popen.stdin.flush()
        told = json.loads(lines.readline())
        if "ready" in told:
            told = json.loads(lines.readline())
    except (OSError, ValueError) as error:
        raise SolverError("the what-if worker ended; ask again") from error
    if "error" in told:
        raise SolverError(str(told["error"]))
    return dict(told)
