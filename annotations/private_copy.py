"""A review log that lies where nothing can be written: read through a copy in memory.

SQLite needs files beside a database even to read it, because of its write-ahead log; in a read-only folder,
or on a full disk, it cannot make them. Database and write-ahead log are copied together, so that what another
program has written and not yet merged is read too. The copy is made anew once the files have changed.
"""

import sqlite3
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from annotations.errors import ReviewError

_LOOKS = 50  # at files that another program is writing to meanwhile
_BETWEEN_S = 0.02  # [s]
_MODES = slice(
    18, 20
)  # bytes of a database's header: how it is written and read; 2 is with a write-ahead log
_WITHOUT_LOG = b"\x01\x01"
_IN_MEMORY = Path("/dev/shm")  # on Linux a folder that no full disk fills

_State = tuple[tuple[int, int, int] | None, ...]


class PrivateCopy:
    """What an SQLite file holds, for connections in memory that nothing can be written through."""

    def __init__(self, path: Path, bring_up_to_date: Callable[[sqlite3.Connection], None]) -> None:
        """Copy it.

        Args:
            path: the database.
            bring_up_to_date: changes a copy of an older version into one of this.

        Raises:
            ReviewError: it cannot be read.
        """
        self._path, self._bring_up_to_date = path, bring_up_to_date
        self._state: _State | None = None
        self._image = b""
        self.connection().close()

    def connection(self) -> sqlite3.Connection:
        """A connection to what the file holds now.

        Raises:
            ReviewError: it cannot be read.
        """
        if self._state is None or _state(self._path) != self._state:
            self._read()
        return _in_memory(self._image)

    def _read(self) -> None:
        try:
            state, content, log = _both(self._path)
            merged = _merged(content, log) if log else content
        except (OSError, sqlite3.Error) as error:
            raise ReviewError(f"{self._path}: the review log cannot be read ({error})") from error
        with closing(_in_memory(merged)) as connection:
            self._bring_up_to_date(connection)
            self._image = connection.serialize()
        self._state = state


def _both(path: Path) -> tuple[_State, bytes, bytes]:
    """The database and its write-ahead log, as they lie there together."""
    side = _side(path)
    for _ in range(_LOOKS):
        before = _state(path)
        content, log = path.read_bytes(), side.read_bytes() if side.exists() else b""
        if _state(path) == before:
            return before, content, log
        time.sleep(_BETWEEN_S)
    raise OSError("another program writes to it without pause; try again when it is done")


def _merged(content: bytes, log: bytes) -> bytes:
    """The database with its write-ahead log worked in, by SQLite, wherever there is room for that."""
    places = [None, str(_IN_MEMORY)] if _IN_MEMORY.is_dir() else [None]
    for place in places:
        try:
            with tempfile.TemporaryDirectory(prefix="addb-viewer-", dir=place) as folder:
                copy = Path(folder) / "copy.sqlite"
                copy.write_bytes(content)
                _side(copy).write_bytes(log)
                with closing(sqlite3.connect(copy)) as connection:
                    return connection.serialize()
        except (OSError, sqlite3.OperationalError):
            if place == places[-1]:
                raise
    raise AssertionError("there is a place")


def _in_memory(image: bytes) -> sqlite3.Connection:
    """A database in memory cannot have a write-ahead log, so its header says that it has none."""
    connection = sqlite3.connect(":memory:", check_same_thread=False)
    if image:
        connection.deserialize(image[: _MODES.start] + _WITHOUT_LOG + image[_MODES.stop :])
    return connection


def _side(path: Path) -> Path:
    return path.with_name(f"{path.name}-wal")


def _state(path: Path) -> _State:
    return tuple(_state_of(file) for file in (path, _side(path)))


def _state_of(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns, found.st_size
