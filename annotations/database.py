"""The database behind a review log: SQLite that a crash does not hurt, or PostgreSQL that a lab shares."""

import os
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.pool import NullPool, StaticPool

from annotations.review_errors import ReviewError
from annotations.schema import OtherSchemaError, is_there, make

PATIENCE_S = 30.0  # [s] how long to wait while another program writes
AGAIN_S = 0.01  # [s] between two tries where SQLite itself does not wait
CONNECT_S = 10  # [s] how long to wait for a server to answer
WRITERS = 0x61646462  # PostgreSQL's number for the lock that writers hold, one at a time

_CANNOT_WRITE = {sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_FULL}
_DAMAGED = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_FORMAT, sqlite3.SQLITE_ERROR}
_BUSY = ("database is locked", "lock timeout")  # as SQLite and PostgreSQL say it
_FULL = "disk is full"
_READ_ONLY = ("readonly database", "read-only transaction")

_LOOKS = 50  # at files that another program is writing to meanwhile
_BETWEEN_S = 0.02  # [s] between two of them
_MODES = slice(18, 20)  # bytes of a database's header: how it is written and read; 2: write-ahead log
_WITHOUT_LOG = b"\x01\x01"
_IN_MEMORY = Path("/dev/shm")  # on Linux a folder that no full disk fills

_State = tuple[tuple[int, int, int] | None, ...]


class _DamagedError(ReviewError):
    """Pages of an SQLite file do not fit together."""


class _UnknownDatabaseError(ValueError):
    """Neither SQLite nor PostgreSQL."""


class Database:
    """Transactions on one database, whose tables are made when it is opened first.

    What a transaction has written is on the disk when `writing` ends, and a process killed at any moment
    leaves every earlier transaction whole: SQLite runs with a write-ahead log and full synchronization,
    PostgreSQL with synchronous commits.

    An SQLite file where nothing can be written, because of permissions or a full disk, is read all the same,
    through a copy in memory; `writing` refuses then, until it is opened again.
    """

    def __init__(self, where: Path | str, patience_s: float = PATIENCE_S) -> None:
        """Open it.

        Args:
            where: an SQLite file, or a database's URL.
            patience_s: how long to wait while another program writes [s].

        Raises:
            ReviewError: it cannot be opened, or another version made it.
        """
        url = _url(where)
        self.name = url.render_as_string(hide_password=True) if is_url(where) else str(where)
        self.file = _file(url)
        self._patience_s = patience_s
        self._refused: str | None = None  # why it can only be read
        with self._in_plain_words():
            self._engine = _engine(url, patience_s)
        try:
            self._make_tables()
        except ReviewError as error:
            self.close()
            self._read_only(error)
        except BaseException:
            self.close()
            raise

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection that sees what has been committed."""
        with self._in_plain_words(), self._engine.begin() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A connection that no other writer comes between; committed when the block ends without error.

        Writers go one after the other, so that edits become visible in the order of their numbers.

        Raises:
            ReviewError: the database can only be read, or another program writes to it for too long.
        """
        if self._refused is not None:
            raise ReviewError(f"{self.name}: {self._refused}")
        engine = self._engine.execution_options(writes=True)
        with self._in_plain_words(), engine.begin() as connection:
            yield connection

    def close(self) -> None:
        """Give up all connections; SQLite's side files are merged into the database."""
        self._engine.dispose()

    def _make_tables(self) -> None:
        with self._of_this_version():
            with self.reading() as connection:
                _check_whole(connection)
                there = is_there(connection)
            if not there:
                with self.writing() as connection:
                    make(connection)

    @contextmanager
    def _of_this_version(self) -> Iterator[None]:
        try:
            yield
        except (OtherSchemaError, _DamagedError) as error:
            raise ReviewError(f"{self.name}: {error}") from error

    def _read_only(self, refused: ReviewError) -> None:
        """Go on with a copy of the file, if it is there and was refused because nothing can be written."""
        code = getattr(getattr(refused.__cause__, "orig", None), "sqlite_errorcode", sqlite3.SQLITE_OK) & 0xFF
        if code not in _CANNOT_WRITE or self.file is None or not self.file.is_file():
            raise refused
        file, self.file = self.file, None
        with self._in_plain_words():
            copy = _PrivateCopy(file, self._check_copy)
        self._engine = create_engine("sqlite://", creator=copy.connection, poolclass=NullPool)
        _begin_transactions(self._engine)
        self._refused = _why_refused(file)

    def _check_copy(self, connection: sqlite3.Connection) -> None:
        engine = create_engine("sqlite://", creator=lambda: connection, poolclass=StaticPool)
        _begin_transactions(engine)
        with engine.begin() as copied, self._of_this_version():
            _check_whole(copied)
            make(copied)

    @contextmanager
    def _in_plain_words(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            raise ReviewError(f"{self.name}: {self._plain_words(error)}") from error
        except UnicodeDecodeError as error:  # from a message of SQLite's that quotes the file
            raise ReviewError(f"{self.name}: {_damaged(error.object.decode(errors='replace'))}") from error
        except (SQLAlchemyError, _UnknownDatabaseError) as error:
            raise ReviewError(f"{self.name}: not a database that can be opened ({error})") from error
        except ImportError as error:
            raise ReviewError(f"{self.name}: install the package '{error.name}' to reach it") from error

    def _plain_words(self, error: DBAPIError) -> str:
        cause = str(error.orig).strip()
        if any(words in cause for words in _BUSY):
            return (
                f"another program has been writing to it for {self._patience_s:g} s; nothing was recorded, "
                "try again when it is done"
            )
        if _FULL in cause:
            return f"nothing was recorded, because the {_FULL}; free some space, and try again"
        if any(words in cause for words in _READ_ONLY):
            return f"it cannot be written to from here ({cause})"
        if getattr(error.orig, "sqlite_errorcode", sqlite3.SQLITE_OK) & 0xFF in _DAMAGED:
            return _damaged(cause)
        return f"the review log cannot be used ({cause})"


def _damaged(cause: str) -> str:
    return (
        f"the review log is damaged ({' '.join(cause.split())}). Move the file away, "
        "and put a whole copy back from a backup; without one, the review begins anew. "
        "`fit --ignore-review` goes on without what was flagged"
    )


def _check_whole(connection: Connection) -> None:
    """Rows that a damaged page no longer leads to are missed by nobody else; odd values are, one by one.

    Raises:
        _DamagedError: an SQLite file is damaged, as a clause.
    """
    if connection.dialect.name == "sqlite":
        found = connection.exec_driver_sql("PRAGMA integrity_check").scalars()
        wrong = [told for told in found if told != "ok" and " value in " not in told]
        if wrong:
            raise _DamagedError(_damaged(wrong[0]))


def is_url(where: Path | str) -> bool:
    """Whether a text names a database by its URL, not a file by its path."""
    return isinstance(where, str) and "://" in where


def _engine(url: URL, patience_s: float) -> Engine:
    match url.get_backend_name():
        case "sqlite":
            engine = create_engine(url, connect_args={"timeout": patience_s})
            _make_sqlite_crash_safe(engine, patience_s)
        case "postgresql":
            engine = create_engine(url, connect_args={"connect_timeout": CONNECT_S}, pool_pre_ping=True)
            _make_postgresql_crash_safe(engine, patience_s)
        case _:
            raise _UnknownDatabaseError("a review store is a postgresql:// or sqlite:// URL")
    return engine


def _url(where: Path | str) -> URL:
    if isinstance(where, str) and is_url(where):
        try:
            url = make_url(where)
        except (SQLAlchemyError, ValueError) as error:
            raise ReviewError(
                "the URL of the review store cannot be read; write postgresql://USER@HOST:PORT/DATABASE"
            ) from error
        by_default = url.drivername in ("postgresql", "postgres")
        return url.set(drivername="postgresql+psycopg") if by_default else url
    path = Path(where)
    if not path.parent.is_dir():
        raise ReviewError(f"{path.parent}: no such folder")
    return URL.create("sqlite", database=str(path))


def _file(url: URL) -> Path | None:
    """The SQLite file that is written to; None for a server, memory, or a file that can only be read."""
    name = url.database if url.get_backend_name() == "sqlite" else None
    return None if not name or name.startswith((":memory:", "file:")) else Path(name)


def _why_refused(file: Path) -> str:
    """What a person is told who wants to record an edit, and can do about it."""
    if all(os.access(place, os.W_OK) for place in (file, file.parent)):
        room = shutil.disk_usage(file.parent).free / 1e6
        return (
            f"nothing was recorded: it was opened read-only, because the disk could not be written "
            f"({room:.1f} MB free); free some space, and open it again"
        )
    return (
        "nothing was recorded: it cannot be written to from here, and was opened read-only; make it "
        "and its folder writable, and open it again"
    )


def _make_sqlite_crash_safe(engine: Engine, patience_s: float) -> None:
    _begin_transactions(engine)

    @event.listens_for(engine, "connect")
    def prepare(connection, _record) -> None:  # type: ignore[no-untyped-def]
        _write_ahead(connection, patience_s)
        connection.execute("PRAGMA synchronous = FULL")


def _begin_transactions(engine: Engine) -> None:
    """Transactions are begun by us, because the driver begins none before reads and schema changes."""

    @event.listens_for(engine, "connect")
    def prepare(connection: sqlite3.Connection, _record: object) -> None:
        connection.isolation_level = None
        connection.text_factory = _text

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE" if _writes(connection) else "BEGIN")


def _text(raw: bytes) -> str:
    """Text of a row; bytes that are no UTF-8 spoil this row alone, and its reader sees them."""
    return raw.decode("utf-8", "surrogateescape")


def _write_ahead(connection: sqlite3.Connection, patience_s: float) -> None:
    """Switch to the write-ahead log; where another one does so just now, SQLite refuses and does not wait."""
    end = time.monotonic() + patience_s
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
        except sqlite3.OperationalError as error:
            if not any(words in str(error) for words in _BUSY) or time.monotonic() > end:
                raise
            time.sleep(AGAIN_S)
        else:
            return


def _make_postgresql_crash_safe(engine: Engine, patience_s: float) -> None:
    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        if _writes(connection):
            connection.exec_driver_sql(
                f"SET LOCAL lock_timeout = {round(1000 * patience_s)}; "
                "SET LOCAL synchronous_commit = on; "
                f"SELECT pg_advisory_xact_lock({WRITERS})"
            )


def _writes(connection: Connection) -> bool:
    return bool(connection.get_execution_options().get("writes", False))


class _PrivateCopy:
    """What an SQLite file holds, for connections in memory that nothing can be written through.

    SQLite needs files beside a database even to read it, because of its write-ahead log; in a read-only
    folder, or on a full disk, it cannot make them. Database and write-ahead log are copied together, so that
    what another program has written and not yet merged is read too. The copy is made anew once the files
    have changed.
    """

    def __init__(self, path: Path, check: Callable[[sqlite3.Connection], None]) -> None:
        """Copy it.

        Args:
            path: the database.
            check: refuses a copy that is damaged or of another version.

        Raises:
            ReviewError: it cannot be read.
        """
        self._path, self._check = path, check
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
            self._check(connection)
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
