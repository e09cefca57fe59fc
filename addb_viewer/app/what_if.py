"""Asks the warm worker what the residual would be with other flags."""

import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from addb_viewer.app.work import PATIENCE_S
from solver.contact.wrenches import MissingRange
from solver.errors import SolverError

WORKER = "addb_viewer.app.what_if_worker"


class WhatIf:
    """One worker a subject, started with the first wish; it keeps the fit in memory until `close`."""

    def __init__(self, subject_folder: Path, results: Path) -> None:
        self._arguments = (str(Path(subject_folder).absolute()), str(Path(results).absolute()))
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None

    def warm(self) -> None:
        """Start the worker, so that the first answer comes soon; returns at once."""
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._process = self._started()

    def ask(
        self, trial: str, present: Sequence[MissingRange], instead: Sequence[MissingRange]
    ) -> dict[str, Any]:
        """The figures of a trial with the present flags and with others.

        Raises:
            SolverError: it cannot be computed; why.
        """
        self.warm()
        question = json.dumps({"trial": trial, "present": list(present), "instead": list(instead)})
        with self._lock:
            process = self._process
            if process is None:
                raise SolverError("the fit has just been replaced; ask again")
            return _asked(process, question)

    def close(self) -> None:
        """End the worker: what it knows is of no use any more."""
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()

    def _started(self) -> "subprocess.Popen[str]":
        return subprocess.Popen(
            [sys.executable, "-m", WORKER, *self._arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
        )


def _asked(process: "subprocess.Popen[str]", question: str) -> dict[str, Any]:
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        process.stdin.write(question + "\n")
        process.stdin.flush()
        told = json.loads(process.stdout.readline())
        if "ready" in told:
            told = json.loads(process.stdout.readline())
    except (OSError, ValueError) as error:
        raise SolverError("the what-if worker ended; ask again") from error
    if "error" in told:
        raise SolverError(str(told["error"]))
    return dict(told)
