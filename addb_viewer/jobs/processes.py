"""Commands of ours in processes of their own: how far they are, how they end; none outlives this one.

A process has its own memory, which is given back, and its death takes no other with it.
"""

import contextlib
import json
import os
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Protocol, TypeVar

import psutil

from addb_viewer.jobs.environment import ENDS_WITH_STDIN, PATIENCE_S, own_process
from solver.common.operating_system import ask_to_end, give_way, polite_kill_is_ctrl_c, signal_of
from solver.common.progress import Progress, silent

OWN = "addb-viewer: "  # begins lines of a command's own on stderr
MEMORY_OF_A_WORKER = 1.6e9  # bytes; a fit of 10 000 frames needs 1.5 GB
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_LOOKED_EVERY_S = 0.5  # at a process's memory and time

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Ended:
    """How a process has ended."""

    status: int  # 0: well; negative: by that signal
    said: str  # on stdout, progress aside
    complained: str  # on stderr
    peak_MB: float = 0.0  # the greatest memory that was seen
    in_time: bool = True

    @property
    def own_words(self) -> str:
        """What the command itself has said on stderr; of one that ended well, what it warned of."""
        lines = self.complained.splitlines()
        return "; ".join(line.removeprefix(OWN) for line in lines if line.startswith(OWN))

    @property
    def last_line(self) -> str:
        """Of stderr."""
        return next((line for line in reversed(self.complained.splitlines()) if line.strip()), "")

    @property
    def reason(self) -> str:
        """Why it failed: in its own words; or the signal that ended it."""
        by = signal_of(self.status)
        if by and not self.own_words:
            return f"ended by {by}; is there enough memory?"
        return self.own_words or self.last_line or f"ended with status {self.status}"


class OwnProcess:
    """A command at work, which ends with this process, however that ends."""

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str] | None = None, *, nice: int = 0
    ) -> None:
        """Start `python -m` the command.

        Args:
            command: module and arguments.
            environment: beside, and instead of, this process's own variables.
            nice: 0 to 19, how far others go first.

        Raises:
            OSError: it cannot be started.
        """
        module, *arguments = command
        self._errors = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 (closed by `wait`)
        self._ended = threading.Event()
        self._peak_MB, self._in_time = 0.0, True
        self.popen = subprocess.Popen(
            [*own_process(module), *arguments],
            stdin=subprocess.PIPE,  # held open until we end
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            encoding="utf-8",
            errors="replace",
            env={**os.environ, ENDS_WITH_STDIN: "1", **(environment or {})},
        )
        if nice:
            give_way(self.popen.pid, nice)

    def wait(self, progress: Progress = silent, time_out_s: float | None = None) -> Ended:
        """Its end, however it comes.

        Args:
            progress: told what it says of how far it is.
            time_out_s: after which it is killed; None: never.
        """
        assert self.popen.stdin is not None
        assert self.popen.stdout is not None
        watch = threading.Thread(target=self._watch, args=(time_out_s,), name="watch of a process")
        watch.start()
        said = []
        with self._errors as errors, self.popen.stdin, self.popen.stdout as lines:
            for line in lines:
                told = _told(line)
                if told is None:
                    said.append(line)
                else:
                    progress(*told)
            status = self.popen.wait()
            self._ended.set()
            watch.join()
            errors.seek(0)
            return Ended(status, "".join(said), errors.read(), self._peak_MB, self._in_time)

    def cancel(self) -> None:
        """End it: politely, so that nothing half written stays; where it does not obey, at once."""
        ask_to_end(self.popen)
        try:
            self.popen.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.popen.kill()

    def _watch(self, time_out_s: float | None) -> None:
        began = time.monotonic()
        wait_s = min(_LOOKED_EVERY_S, time_out_s or _LOOKED_EVERY_S)
        while not self._ended.wait(wait_s):
            with contextlib.suppress(psutil.Error):
                memory = psutil.Process(self.popen.pid).memory_info()
                self._peak_MB = max(self._peak_MB, memory.rss / 1e6)
            if time_out_s is not None and time.monotonic() - began >= time_out_s:
                self._in_time = False
                self.popen.kill()
                return


class Start(Protocol):
    """Starts a process and waits for its end."""

    def __call__(
        self, command: Sequence[str], environment: Mapping[str, str], time_out_s: float | None = None
    ) -> Ended:
        """Arguments as for `OwnProcess` and `OwnProcess.wait`."""
        ...


class Engine(Protocol):
    """Does something to many things, in processes of this machine or of others."""

    def run(
        self,
        items: Sequence[Item],
        do: Callable[[Item, Start], Result],
        done: Callable[[Item, Result | None], None],
    ) -> None:
        """Do it to all of them, in any order.

        Args:
            items: to be done.
            do: it to one, by starting a process; called in another thread, or on another machine.
            done: told of each as it ends, in the caller's thread; None: who did it died again and again.
        """
        ...


class Processes:
    """Processes of this machine, so many at a time; what ends one run ends all of its processes."""

    def __init__(self, at_once: int) -> None:
        """Nothing is started yet."""
        self._at_once = at_once
        self._running: set[OwnProcess] = set()
        self._lock = threading.Lock()
        self._stopped = False

    def run(
        self,
        items: Sequence[Item],
        do: Callable[[Item, Start], Result],
        done: Callable[[Item, Result | None], None],
    ) -> None:
        """As for `Engine`.

        Raises:
            KeyboardInterrupt: stopped, by Ctrl-C or a polite kill.
        """
        pool = ThreadPoolExecutor(self._at_once)
        with polite_kill_is_ctrl_c():
            try:
                waiting = {pool.submit(do, item, self.start): item for item in items}
                for future in as_completed(waiting):
                    done(waiting[future], future.result())
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                self._stop()
                raise
            finally:
                pool.shutdown()

    def start(
        self, command: Sequence[str], environment: Mapping[str, str], time_out_s: float | None = None
    ) -> Ended:
        """Run a command to its end.

        Raises:
            InterruptedError: the run has been stopped.
        """
        with self._lock:
            if self._stopped:
                raise InterruptedError
            process = OwnProcess(command, environment)
            self._running.add(process)
        try:
            return process.wait(time_out_s=time_out_s)
        finally:
            with self._lock:
                self._running.discard(process)

    def _stop(self) -> None:
        with self._lock:
            self._stopped, running = True, [*self._running]
        for process in running:
            ask_to_end(process.popen)
        for process in running:
            process.cancel()


def usual_workers() -> int:
    """One a core, as far as the memory reaches."""
    return max(1, min(os.cpu_count() or 1, int(psutil.virtual_memory().total // MEMORY_OF_A_WORKER)))


def print_progress(stage: str, fraction: float) -> None:
    """In a process of ours: say how far it is, as a line that `OwnProcess.wait` understands."""
    print(json.dumps({"stage": stage, "fraction": fraction}), flush=True)


def _told(line: str) -> tuple[str, float] | None:
    """Stage and fraction of a line of progress; None for any other."""
    if not line.startswith("{"):
        return None
    try:
        told = json.loads(line)
        return str(told["stage"]), float(told["fraction"])
    except (ValueError, KeyError, TypeError):
        return None
