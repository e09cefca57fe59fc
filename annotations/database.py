"""The database behind a review log: SQLite that a crash does not hurt, or PostgreSQL that a lab shares."""

import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from annotations.errors import ReviewError
from annotations.schema import NewerSchemaError, is_current, migrate

PATIENCE_S = 30.0  # [s] how long to wait while another program writes
AGAIN_S = 0.01  # [s] between two tries where SQLite itself does not wait
CONNECT_S = 10  # [s] how long to wait for a server to answer
WRITERS = 0x61646462  # PostgreSQL's number for the lock that writers hold, one at a time

_BUSY = ("database is locked", "lock timeout")  # as SQLite and PostgreSQL say it
_READ_ONLY = ("readonly database", "read-only transaction")


class _UnknownDatabaseError(ValueError):
    """Neither SQLite nor PostgreSQL."""


class Database:
    """Transactions on one database, brought to this version's schema when opened.

    What a transaction has written is on the disk when `writing` ends, and a process killed at any moment
    leaves every earlier transaction whole: SQLite runs with a write-ahead log and full synchronization,
    PostgreSQL with synchronous commits.
    """

    def __init__(self, where: Path | str, patience_s: float = PATIENCE_S) -> None:
        """Open it.

        Args:
            where: an SQLite file, or a database's URL.
            patience_s: how long to wait while another program writes [s].

        Raises:
            ReviewError: it cannot be opened, or a newer version made it.
        """
        url = _url(where)
        self.name = url.render_as_string(hide_password=True) if is_url(where) else str(where)
        self.file = _file(url)
        self._patience_s = patience_s
        with self._in_plain_words():
            self._engine = _engine(url, patience_s)
        try:
            self._bring_up_to_date()
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
        """
        engine = self._engine.execution_options(writes=True)
        with self._in_plain_words(), engine.begin() as connection:
            yield connection

    def close(self) -> None:
        """Give up all connections; SQLite's side files are merged into the database."""
        self._engine.dispose()

    def _bring_up_to_date(self) -> None:
        try:
            with self.reading() as connection:
                current = is_current(connection)
            if not current:
                with self.writing() as connection:
                    migrate(connection)
        except NewerSchemaError as error:
            raise ReviewError(f"{self.name}: {error}") from error

    @contextmanager
    def _in_plain_words(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            raise ReviewError(f"{self.name}: {self._plain_words(error)}") from error
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
        if any(words in cause for words in _READ_ONLY):
            return f"it cannot be written to from here ({cause})"
        return f"the review log cannot be used ({cause})"


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
            raise _UnknownDatabaseError("reviews are kept in postgresql:// or sqlite:// alone")
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
    if path.exists() and _cannot_change(path):
        name = f"file:{quote(str(path.absolute()))}"
        return URL.create("sqlite", database=name, query={"mode": "ro", "immutable": "1", "uri": "true"})
    return URL.create("sqlite", database=str(path))


def _file(url: URL) -> Path | None:
    """The SQLite file that is written to; None for a server, memory, or a file that can only be read."""
    name = url.database if url.get_backend_name() == "sqlite" else None
    return None if not name or name.startswith((":memory:", "file:")) else Path(name)


def _cannot_change(path: Path) -> bool:
    """Whether a file can only be read as it lies there, in a folder without side files of a writer."""
    return not os.access(path.parent, os.W_OK) and not path.with_name(f"{path.name}-wal").exists()


def _make_sqlite_crash_safe(engine: Engine, patience_s: float) -> None:
    """Transactions are begun by us, because the driver begins none before reads and schema changes."""

    @event.listens_for(engine, "connect")
    def prepare(connection, _record) -> None:  # type: ignore[no-untyped-def]
        connection.isolation_level = None
        connection.text_factory = _text
        _write_ahead(connection, patience_s)
        connection.execute("PRAGMA synchronous = FULL")

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
