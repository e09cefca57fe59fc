"""Whether the file behind an open review log is still the one that was opened, with all that it held."""

import sqlite3
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

_LOOKS = 4  # another program may be moving edits into the file during the first ones
_BETWEEN_S = 0.05  # [s] likewise; a move writes without pause, so that it shows in the file's time


@dataclass(frozen=True)
class _Last:
    """The last edit in the file itself; those of the write-ahead log come later."""

    number: int
    made_at: Any  # as it lies there


class KeptFile:
    """Looks at one SQLite file from outside its connections, which stay with the file that they opened.

    A file put in its place is another one by device and inode. One that was written over stays the same by
    these; but nothing is ever removed from a log, so the last edit that was once in it has to be in it still.
    """

    def __init__(self, path: Path) -> None:
        """Remember what is there now, while a connection holds it open."""
        self._path = path
        self._side = path.with_name(f"{path.name}-wal")
        self._whose = (_identity(path), _identity(self._side))
        self._state = _state(path)
        self._last: _Last | None = None
        _, self._last = self._held()

    def loss(self) -> str:
        """What has happened to the file, as a clause; empty where it is as it should be."""
        if _identity(self._path) is None:
            return "the file was deleted or moved away while it was open"
        if (_identity(self._path), _identity(self._side)) != self._whose:
            return "another file was put in its place while it was open"
        if _state(self._path) == self._state:
            return ""
        is_settled = False
        for look in range(_LOOKS):
            if look:
                time.sleep(_BETWEEN_S)
            state = _state(self._path)
            is_whole, last = self._held()
            is_settled = state == _state(self._path)
            if is_settled and is_whole:
                self._state, self._last = state, last
                return ""
        return "it was overwritten with an older or another copy while it was open" if is_settled else ""

    def _held(self) -> tuple[bool, _Last | None]:
        """Whether the edit that was the last one is still in the file; and the one that is now."""
        try:
            return self._last is None or self._has(self._last), self._read_last()
        except sqlite3.DatabaseError:
            return False, None

    def _has(self, last: _Last) -> bool:
        found = self._ask("SELECT made_at FROM edits WHERE number = ?", last.number)
        return found == (last.made_at,)

    def _read_last(self) -> _Last | None:
        if self._ask("SELECT 1 FROM sqlite_master WHERE name = 'edits'") is None:
            return None
        found = self._ask("SELECT number, made_at FROM edits ORDER BY number DESC LIMIT 1")
        return None if found is None else _Last(*found)

    def _ask(self, question: str, *values: int) -> tuple[Any, ...] | None:
        """Ask the file alone, without its write-ahead log."""
        name = f"file:{quote(str(self._path.absolute()))}?mode=ro&immutable=1"
        connection = sqlite3.connect(name, uri=True)
        connection.text_factory = bytes  # compared, not read: it may be no text at all
        try:
            found: tuple[Any, ...] | None = connection.execute(question, values).fetchone()
            return found
        finally:
            connection.close()


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _state(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
