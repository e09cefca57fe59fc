"""The tables of the review log, and how a database of an older version becomes one of this.

Only types that SQLite and PostgreSQL share: integers, text, JSON. Times are ISO 8601 text in UTC. What makes
the tables is in `annotations.migrations`; here they are as statements use them.
"""

import threading

from sqlalchemy import JSON, Column, Connection, Index, Integer, MetaData, String, Table, inspect, select

from annotations.errors import ReviewError

VERSION = "0003"  # the last step of `annotations.migrations`
VERSION_TABLE = "annotations_version"

_METADATA = MetaData()
_ONE_AT_A_TIME = threading.Lock()  # alembic keeps the connection of its steps in a global


def _log(name: str, *indexes: Index) -> Table:
    return Table(
        name,
        _METADATA,
        Column("number", Integer, primary_key=True),
        Column("subject", String, nullable=False),
        Column("trial", String, nullable=False),
        Column("author", String, nullable=False),
        Column("made_at", String, nullable=False),
        Column("kind", String, nullable=False),
        Column("content", JSON, nullable=False),
        *indexes,
        sqlite_autoincrement=True,
    )


EDITS = _log(
    "edits", Index("edits_of_trial", "subject", "trial"), Index("edits_of_subject", "subject", "number")
)
WORK = _log("work", Index("work_of_subject", "subject", "number"))
_VERSIONS = Table(VERSION_TABLE, MetaData(), Column("version_num", String, nullable=False))


class NewerSchemaError(ReviewError):
    """A newer version of the program made the database."""


def is_current(connection: Connection) -> bool:
    """Whether the database is of this version.

    Raises:
        NewerSchemaError: it is of a newer one.
    """
    found = _version(connection)
    if found is not None and found > VERSION:
        raise NewerSchemaError(
            f"made by a newer version of addb-viewer (schema {found}; this version knows up to {VERSION}); "
            "update addb-viewer"
        )
    return found == VERSION


def migrate(connection: Connection) -> None:
    """Apply what the database lacks, within the connection's transaction: all of it or nothing."""
    from alembic import command  # noqa: PLC0415 (a third of a second, and only an older database needs it)
    from alembic.config import Config  # noqa: PLC0415

    if is_current(connection):
        return
    config = Config(attributes={"connection": connection})
    config.set_main_option("script_location", "annotations:migrations")
    with _ONE_AT_A_TIME:
        command.upgrade(config, "head")


def _version(connection: Connection) -> str | None:
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    return connection.scalar(select(_VERSIONS.c.version_num))
