"""The database behind a review log: SQLite that a crash does not hurt, or another one by its URL."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from annotations.errors import ReviewError
from annotations.schema import NewerSchemaError, is_current, migrate

PATIENCE_S = 30  # [s] how long to wait while another program writes


class Database:
    """Transactions on one database, brought to this version's schema when opened.

    SQLite runs with a write-ahead log and full synchronization: what a transaction has written is on the disk
    when `writing` ends, and a process killed at any moment leaves every earlier transaction whole.
    """

    def __init__(self, where: Path | str) -> None:
        self.name = _shown(where)
        with self._in_plain_words():
            self._engine = create_engine(_url(where), **_arguments(where))
        if self._engine.dialect.name == "sqlite":
            _make_crash_safe(self._engine)
        try:
            self._bring_up_to_date()
        except BaseException:
            self.close()
            raise

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection that sees one state of the database."""
        with self._in_plain_words(), self._engine.begin() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A connection that no other writer comes between; committed when the block ends without error."""
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
            raise ReviewError(f"{self.name}: the review log cannot be used ({error.orig})") from error
        except SQLAlchemyError as error:
            raise ReviewError(f"{self.name}: not a database that can be opened ({error})") from error
        except ImportError as error:
            raise ReviewError(f"{self.name}: install the package '{error.name}' to reach it") from error


def _url(where: Path | str) -> URL:
    if isinstance(where, str) and "://" in where:
        return make_url(where)
    path = Path(where)
    if not path.parent.is_dir():
        raise ReviewError(f"{path.parent}: no such folder")
    if path.exists() and _cannot_change(path):
        name = f"file:{quote(str(path.absolute()))}"
        return URL.create("sqlite", database=name, query={"mode": "ro", "immutable": "1", "uri": "true"})
    return URL.create("sqlite", database=str(path))


def _cannot_change(path: Path) -> bool:
    """Whether a file can only be read as it lies there, in a folder without side files of a writer."""
    return not os.access(path.parent, os.W_OK) and not path.with_name(f"{path.name}-wal").exists()


def _arguments(where: Path | str) -> dict[str, object]:
    on_disk = not (isinstance(where, str) and "://" in where)
    return {"connect_args": {"timeout": PATIENCE_S}} if on_disk else {}


def _shown(where: Path | str) -> str:
    if isinstance(where, str) and "://" in where:
        return make_url(where).render_as_string(hide_password=True)
    return str(where)


def _make_crash_safe(engine: Engine) -> None:
    """Transactions are begun by us, because the driver begins none before reads and schema changes."""

    @event.listens_for(engine, "connect")
    def prepare(connection, _record) -> None:  # type: ignore[no-untyped-def]
        connection.isolation_level = None
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")
