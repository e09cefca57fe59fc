"""One writer at a time in a results folder: a lock that ends with the process that holds it.

It is held while what was written is put in its place, not while a fit is solved or its arrays are written.
Readers take no lock: they see what was there before or what is there after.
"""

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from solver.common.disk_errors import writing_failed
from solver.common.errors import ResultsError
from solver.common.operating_system import remove_lock, taken

LOCK = ".writing"  # in the results folder, while somebody writes
PATIENCE_S = 120.0  # [s] how long to wait for another writer, which takes seconds on a slow share


@dataclass
class _Place:
    """A results folder within this process, whose threads take turns too."""

    turn: threading.RLock = field(default_factory=threading.RLock)
    handle: int | None = None
    depth: int = 0
    is_alone: bool = False


_places: dict[str, _Place] = {}
_of_places = threading.Lock()


@contextmanager
def writing(folder: Path, patience_s: float = PATIENCE_S) -> Iterator[bool]:
    """Be the only one who changes a results folder; may be entered again by who holds it.

    Args:
        folder: the results folder, made where it is missing.
        patience_s: how long to wait while another program writes [s].

    Yields:
        Whether nobody else can write; False where the file system has no locks. There, what others may be
        writing must be left alone.

    Raises:
        ResultsError: another program has been writing for too long, or the folder cannot be written to.
    """
    with _of_places:
        place = _places.setdefault(os.path.realpath(folder), _Place())
    with place.turn:
        if place.depth == 0:
            place.handle, place.is_alone = _locked(folder / LOCK, patience_s)
        place.depth += 1
        try:
            yield place.is_alone
        finally:
            place.depth -= 1
            if place.depth == 0 and place.handle is not None:
                remove_lock(folder / LOCK, place.handle)


def _locked(file: Path, patience_s: float) -> tuple[int, bool]:
    """The open lock, and whether it locks anything here; one that its holder removed is made anew."""
    while True:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise ResultsError(writing_failed(file.parent, error)) from error
        held = taken(handle, patience_s)
        if held is False:
            who = os.read(handle, 200).decode(errors="replace").strip()
            os.close(handle)
            raise ResultsError(
                f"{file.parent}: another program ({who or 'unknown'}) has been writing here for "
                f"{patience_s:g} s. Let it end, or end it, and try again."
            )
        if held is None or _is_still(file, handle):
            _sign(handle)
            return handle, bool(held)
        os.close(handle)


def _is_still(file: Path, handle: int) -> bool:
    try:
        return os.path.samestat(os.stat(file), os.fstat(handle))
    except OSError:
        return False


def _sign(handle: int) -> None:
    """Who writes, for those who wait; on a full disk nobody's name is there."""
    said = f"process {os.getpid()} on {socket.gethostname()}, since {datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC"
    try:
        os.ftruncate(handle, 0)
        os.lseek(handle, 0, os.SEEK_SET)
        os.write(handle, said.encode())
    except OSError:
        return
