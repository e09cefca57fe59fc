"""The tables of the review log, and how a database of an older version becomes one of this.

Only types that SQLite and PostgreSQL share: integers, text, JSON. Times are ISO 8601 text in UTC.
"""

from collections.abc import Callable

from sqlalchemy import (
    DDL,
    JSON,
    Column,
    Connection,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    func,
    insert,
    inspect,
    select,
    update,
)

from annotations.errors import ReviewError


class NewerSchemaError(ReviewError):
    """A newer version of the program made the database."""


def _edits(metadata: MetaData) -> Table:
    return Table(
        "edits",
        metadata,
        Column("number", Integer, primary_key=True),
        Column("subject", String, nullable=False),
        Column("trial", String, nullable=False),
        Column("author", String, nullable=False),
        Column("made_at", String, nullable=False),
        Column("kind", String, nullable=False),
        Column("content", JSON, nullable=False),
        Index("edits_of_trial", "subject", "trial"),
        sqlite_autoincrement=True,  # a number is never given twice
    )


_METADATA = MetaData()
EDITS = _edits(_METADATA)
SCHEMA_VERSION = Table("schema_version", _METADATA, Column("version", Integer, nullable=False))

_FORBID = """
CREATE TRIGGER edits_no_{verb} BEFORE {verb} ON edits
BEGIN SELECT RAISE(ABORT, 'the review log is append-only'); END
"""


def _first(connection: Connection) -> None:
    """The log of edits; SQLite refuses to change or remove one."""
    _edits(MetaData()).create(connection)
    if connection.dialect.name == "sqlite":
        for verb in ("UPDATE", "DELETE"):
            connection.execute(DDL(_FORBID.format(verb=verb)))


MIGRATIONS: tuple[Callable[[Connection], None], ...] = (_first,)  # version n: the first n have been applied


def is_current(connection: Connection) -> bool:
    """Whether the database is of this version.

    Raises:
        NewerSchemaError: it is of a newer one.
    """
    found = _version(connection)
    if found > len(MIGRATIONS):
        raise NewerSchemaError(
            f"made by a newer version of addb-viewer (schema {found}; this version knows up to "
            f"{len(MIGRATIONS)}); update addb-viewer"
        )
    return found == len(MIGRATIONS)


def migrate(connection: Connection) -> None:
    """Apply what the database lacks, within the connection's transaction: all of it or nothing."""
    if is_current(connection):
        return
    found = _version(connection)
    if found == 0:
        SCHEMA_VERSION.create(connection)
        connection.execute(insert(SCHEMA_VERSION).values(version=0))
    for step in MIGRATIONS[found:]:
        step(connection)
    connection.execute(update(SCHEMA_VERSION).values(version=len(MIGRATIONS)))


def _version(connection: Connection) -> int:
    if not inspect(connection).has_table(SCHEMA_VERSION.name):
        return 0
    return connection.scalar(select(func.max(SCHEMA_VERSION.c.version))) or 0
