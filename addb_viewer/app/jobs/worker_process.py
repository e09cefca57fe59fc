"""A command of ours in a process of its own, so that the page stays alive: progress, outcome, cancel."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import IO

from addb_viewer.app.jobs.turns import Turns
from addb_viewer.jobs.own_packages import own_process

LOWEST = 19  # of 19: what nobody waits for
NICE = 10  # of 19: the less, the sooner it gets the processor; the app itself has 0
CANCELLED = 143  # exit status, as shells count it
OWN = "addb-viewer: "  # begins lines of a command's own on stderr
PATIENCE_S = 5.0  # for a process that was told to end
TURNS = Turns()


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    succeeded: bool
    cancelled: bool
    said: str  # on stdout, progress aside
    error: str  # the last line on stderr; of one that succeeded, what it warned of


def progress_line(stage: str, fraction: float) -> str:
    """Progress as a line on stdout that `WorkerProcess` understands."""
    return json.dumps({"stage": stage, "fraction": fraction})


def print_progress(stage: str, fraction: float) -> None:
    """What a process of ours gives to a solve or a diagnosis."""
    print(progress_line(stage, fraction), flush=True)


def end_in_order() -> None:
    """In a process of ours: let the SIGTERM of `WorkerProcess.cancel` clear away what is half written."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(CANCELLED))


class WorkerProcess:
    """At most one command at a time. Both callbacks come from a thread of its own."""

    def __init__(
        self,
        progress: Callable[[str, float], None],
        ended: Callable[[Outcome], None],
        turns: Turns = TURNS,
    ) -> None:
        self._progress, self._ended, self._turns = progress, ended, turns
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._cancelled = False

    @property
    def running(self) -> bool:
        """Whether a command is at work."""
        with self._lock:
            return self._process is not None

    def start(self, module: str, arguments: Sequence[str]) -> bool:
        """Run `python -m module arguments`; False where one is running already."""
        with self._lock:
            if self._process is not None:
                return False
            errors = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 (closed by the thread)
            self._cancelled = False
            self._process = subprocess.Popen(
                [*own_process(module), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                encoding="utf-8",
                errors="replace",
                env=self._turns.environment,
                pass_fds=self._turns.open_files,
            )
            process = self._process
            give_way(process.pid)
        threading.Thread(target=self._follow, args=(process, errors), name="work", daemon=True).start()
        return True

    def cancel(self) -> None:
        """End the command now; its results are written whole or not at all."""
        with self._lock:
            process, self._cancelled = self._process, True
        if process is not None:
            process.terminate()
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()

    def _follow(self, process: "subprocess.Popen[str]", errors: IO[str]) -> None:
        said = []
        assert process.stdout is not None
        with errors, process.stdout as lines:
            for line in lines:
                told = _told(line)
                if told is None:
                    said.append(line)
                else:
                    self._progress(*told)
            status = process.wait()
            errors.seek(0)
            last = next(reversed([text for text in errors.read().splitlines() if text.strip()]), "")
        with self._lock:
            self._process, cancelled = None, self._cancelled
        if status == 0 and not last.startswith(OWN):
            last = ""
        self._ended(Outcome(status == 0, cancelled, "".join(said), last.removeprefix(OWN)))


def give_way(process: int, nice: int = NICE) -> None:
    """Let the page have the processor first, where the system knows of such things."""
    if hasattr(os, "setpriority"):
        with contextlib.suppress(OSError):  # it has ended already
            os.setpriority(os.PRIO_PROCESS, process, nice)


def _told(line: str) -> tuple[str, float] | None:
    """Stage and fraction of a line of progress; None for any other."""
    if not line.startswith("{"):
        return None
    try:
        told = json.loads(line)
        return str(told["stage"]), float(told["fraction"])
    except (ValueError, KeyError, TypeError):
        return None
