"""The tables of the review log: rows are added, never changed or removed, which the database itself sees to.

Only types that SQLite and PostgreSQL share: integers, text, JSON. Times are ISO 8601 text in UTC.
"""

import sqlalchemy as sa
from sqlalchemy import JSON, Column, Connection, Index, Integer, MetaData, String, Table

from annotations.review_errors import ReviewError

VERSION = "0003"  # of these tables; a database keeps it
VERSION_TABLE = "annotations_version"

_APPEND_ONLY = "the review log is append-only"
_METADATA = MetaData()
_VERSIONS = Table(VERSION_TABLE, _METADATA, Column("version_num", String, nullable=False))


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
        sqlite_autoincrement=True,  # a number is never given twice
    )


EDITS = _log(
    "edits", Index("edits_of_trial", "subject", "trial"), Index("edits_of_subject", "subject", "number")
)
WORK = _log("work", Index("work_of_subject", "subject", "number"))


class OtherSchemaError(ReviewError):
    """Another version of the program made the database."""


def is_there(connection: Connection) -> bool:
    """Whether the database has the tables.

    Raises:
        OtherSchemaError: it has those of another version.
    """
    if not sa.inspect(connection).has_table(VERSION_TABLE):
        return False
    found = connection.scalar(sa.select(_VERSIONS.c.version_num))
    if found != VERSION:
        raise OtherSchemaError(
            f"made by another version of addb-viewer (schema {found}; this version knows {VERSION}); "
            "update addb-viewer"
        )
    return True


def make(connection: Connection) -> None:
    """Make the tables where they are not there, within the connection's transaction."""
    if is_there(connection):
        return
    _METADATA.create_all(connection)
    connection.execute(sa.insert(_VERSIONS).values(version_num=VERSION))
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(
            "CREATE FUNCTION edits_append_only() RETURNS trigger LANGUAGE plpgsql AS "
            f"$$ BEGIN RAISE EXCEPTION '{_APPEND_ONLY}'; END $$"
        )
    for table in (EDITS, WORK):
        for statement in _forbidding(table.name, connection.dialect.name):
            connection.exec_driver_sql(statement)


def _forbidding(table: str, dialect: str) -> list[str]:
    """Triggers that refuse to change or remove a row."""
    if dialect == "sqlite":
        return [
            f"CREATE TRIGGER {table}_no_{verb} BEFORE {verb} ON {table} "
            f"BEGIN SELECT RAISE(ABORT, '{_APPEND_ONLY}'); END"
            for verb in ("UPDATE", "DELETE")
        ]
    return [
        f"CREATE TRIGGER {table}_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {table} "
        "FOR EACH STATEMENT EXECUTE FUNCTION edits_append_only()"
    ]
