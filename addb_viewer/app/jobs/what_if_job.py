"""Asks the warm worker what the residual would be with other flags."""

import contextlib
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
        self._prepared, self._closed = "", False

    def warm(self, trial: str | None = None, present: ForceReview | None = None) -> None:
        """Start the worker, so that the first answer comes soon; never waits.

        Args:
            trial: that will be asked about; its present side is computed already. None: nobody knows yet.
            present: what people say about its forces.
        """
        if not self._lock.acquire(blocking=False):
            return  # it is at work already
        try:
            process = self._alive()
            question = json.dumps({"prepare": trial, "present": as_plain(present or ForceReview())})
            if trial is not None and question != self._prepared:
                self._prepared = question
                with contextlib.suppress(OSError, ValueError):  # it ended; whoever asks is told why
                    _say(process, question)
        finally:
            self._lock.release()

    def ask(self, trial: str, present: ForceReview, instead: ForceReview) -> dict[str, Any]:
        """The figures of a trial with the present decisions and with others.

        Raises:
            SolverError: it cannot be computed; why.
        """
        question = json.dumps({"trial": trial, "present": as_plain(present), "instead": as_plain(instead)})
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
            self._process, self._prepared = OwnProcess((*WORKER, *self._arguments), nice=NICE), ""
        return self._process


def _say(process: OwnProcess, question: str) -> None:
    assert process.popen.stdin is not None
    process.popen.stdin.write(question + "\n")
    process.popen.stdin.flush()


def _asked(process: OwnProcess, question: str) -> dict[str, Any]:
    assert process.popen.stdout is not None
    lines = process.popen.stdout
    try:
        _say(process, question)
        told = json.loads(lines.readline())
        if "ready" in told:
            told = json.loads(lines.readline())
    except (OSError, ValueError) as error:
        raise SolverError("the what-if worker ended; ask again") from error
    if "error" in told:
        raise SolverError(str(told["error"]))
    return dict(told)
