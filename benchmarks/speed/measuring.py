"""What work costs: CPU seconds, seconds on the clock and memory, of a function or of a command."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import Empty, Queue
from typing import TypeVar

import psutil

from solver.capture.atomic import write_whole

Result = TypeVar("Result")
READY_S = 300.0  # on a busy machine
LOOK_AGAIN_S = 0.1


@dataclass(frozen=True)
class Cost:
    """Of one command and all its processes."""

    seconds: float  # on the clock
    cpu_s: float
    peak_MB: float  # of the largest process
    load: float  # mean number of busy processes on the machine in the minute before its end


def cost_of(*words: str) -> Cost:
    """Run a command of ours in a process of its own.

    Args:
        words: after `addb-viewer`.

    Raises:
        RuntimeError: it failed.
    """
    began, before, peak = time.monotonic(), os.times(), 0.0
    process = psutil.Popen([sys.executable, "-m", "addb_viewer", *words], stdout=subprocess.DEVNULL)
    while process.poll() is None:
        with suppress(psutil.Error, OSError):  # one of them has just ended
            pids = [process.pid, *(child.pid for child in process.children(recursive=True))]
            peak = max(peak, *(_megabytes(pid, "VmHWM") for pid in pids))
        time.sleep(LOOK_AGAIN_S)
    if process.returncode:
        raise RuntimeError(f"addb-viewer {' '.join(words)}: ended with status {process.returncode}")
    after = os.times()
    cpu_s = after.children_user - before.children_user + after.children_system - before.children_system
    return Cost(time.monotonic() - began, cpu_s, peak, os.getloadavg()[0])


def cpu_seconds(work: Callable[[], Result], repeats: int = 1) -> tuple[Result, float]:
    """What some work gives, and the CPU seconds of its fastest run."""
    spent = []
    for _ in range(repeats):
        began = time.process_time()
        result = work()
        spent.append(time.process_time() - began)
    return result, min(spent)


class Kept:
    """Figures by name in a file, each written as soon as it is made: who is stopped goes on there."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.figures: dict[str, dict[str, float]] = json.loads(file.read_text()) if file.is_file() else {}

    def get(self, name: str, make: Callable[[], Cost]) -> dict[str, float]:
        """The kept figures, else new ones.

        Args:
            name: of the measurement.
            make: measures.
        """
        if name not in self.figures:
            self.figures[name] = asdict(make())
            self._file.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self._file, json.dumps(self.figures, indent=1))
            print(name, self.figures[name], flush=True)
        return self.figures[name]


@contextmanager
def running(module: str, *arguments: str) -> "Iterator[tuple[subprocess.Popen[str], str]]":
    """A module in a process of its own, and the first line that it says.

    Args:
        module: as `python -m` takes it.
        arguments: of it.

    Raises:
        RuntimeError: it ended, or says nothing in time.
    """
    process = subprocess.Popen([sys.executable, "-m", module, *arguments], stdout=subprocess.PIPE, text=True)
    try:
        yield process, _first_line(process, " ".join(arguments))
    finally:
        process.terminate()  # not SIGINT, which whatever runs in a shell's background ignores
        try:
            process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _first_line(process: "subprocess.Popen[str]", what: str) -> str:
    assert process.stdout is not None
    lines, read = Queue[str](), process.stdout.readline
    threading.Thread(target=lambda: lines.put(read()), daemon=True).start()
    try:
        line = lines.get(timeout=READY_S)
    except Empty as error:
        raise RuntimeError(f"{what}: not ready after {READY_S:g} s") from error
    if not line:
        raise RuntimeError(f"{what}: ended before it was ready; its last words stand above")
    return line


def until_told_to_end() -> None:
    """Wait; SIGTERM ends it as Ctrl+C does."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with suppress(KeyboardInterrupt):
        while True:
            signal.pause()  # other signals wake it as well


def resident_megabytes(process: int) -> float:
    """Memory that a process has in use now [MB]."""
    return _megabytes(process, "VmRSS")


def peak_megabytes() -> float:
    """The most memory that this process has had in use [MB], not what it was forked from had."""
    return _megabytes(os.getpid(), "VmHWM")


def _megabytes(process: int, line: str) -> float:
    status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    found = re.search(rf"{line}:\s+(\d+) kB", status)
    return int(found[1]) / 1024 if found else 0.0
