"""Processes that a benchmark starts: until the first line they say, their memory, and their end."""

import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, Queue

READY_S = 300.0  # on a busy machine


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
    status = Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    found = re.search(r"VmRSS:\s+(\d+) kB", status)
    assert found is not None
    return int(found[1]) / 1024
