"""The database behind the log: its versions, what it refuses, and where it can only be read."""

import os
import sqlite3

import pytest
from sqlalchemy import inspect, text
from sqlalchemy.dialects import postgresql
from sqlalchemy.schema import CreateTable

from annotations import schema
from annotations.database import Database
from annotations.errors import ReviewError
from annotations.events import FlagRange
from annotations.log import ReviewLog
from annotations.schema import EDITS, SCHEMA_VERSION

FLAG = FlagRange(10, 20, "manualReview")


@pytest.fixture
def kept(path):
    """A log with one edit, closed."""
    with ReviewLog.open(path) as log:
        log.append("walk", FLAG, "anna")
    return path


def add_a_column(connection):
    connection.execute(text("ALTER TABLE edits ADD COLUMN program VARCHAR"))


def fail_half_way(connection):
    add_a_column(connection)
    raise RuntimeError("power cut")


def columns_and_version(path):
    database = Database(path)
    try:
        with database.reading() as connection:
            names = {column["name"] for column in inspect(connection).get_columns("edits")}
            return names, connection.scalar(text("SELECT version FROM schema_version"))
    finally:
        database.close()


def test_the_migrations_make_the_table_that_the_program_uses(path):
    names, version = columns_and_version(path)
    assert names == {column.name for column in EDITS.columns}
    assert version == len(schema.MIGRATIONS)


def test_an_older_database_is_brought_up_to_date_and_keeps_its_edits(kept, monkeypatch):
    monkeypatch.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, add_a_column))
    with ReviewLog.open(kept) as log:
        assert [edit.event for edit in log.history()] == [FLAG]
    names, version = columns_and_version(kept)
    assert "program" in names
    assert version == 2


def test_a_migration_that_fails_leaves_the_database_as_it_was(kept, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, fail_half_way))
        with pytest.raises(RuntimeError):
            ReviewLog.open(kept)
    names, version = columns_and_version(kept)
    assert "program" not in names
    assert version == 1


def test_a_database_of_a_newer_version_is_refused_untouched(kept):
    with sqlite3.connect(kept) as raw:
        raw.execute("UPDATE schema_version SET version = 9")
    raw.close()
    before = kept.read_bytes()
    with pytest.raises(
        ReviewError, match=r"annotations\.sqlite: made by a newer version of addb-viewer \(schema 9;.*update"
    ):
        ReviewLog.open(kept)
    assert kept.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("other.sqlite", "these are no pages of a database, " * 99, "file is not a database"),
        ("folder/no.sqlite", None, "folder: no such folder"),
    ],
)
def test_what_is_no_database_is_refused_by_name(tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(ReviewError, match=said):
        ReviewLog.open(tmp_path / name)


def test_a_password_in_a_url_is_not_shown():
    with pytest.raises(ReviewError) as failure:
        ReviewLog.open("nosuchdatabase://anna:secret@localhost/lab")
    assert "secret" not in str(failure.value)
    assert "nosuchdatabase://anna:***@localhost/lab" in str(failure.value)


def test_what_is_written_is_synchronized_to_the_disk(path):
    database = Database(path)
    with database.reading() as connection:
        assert connection.scalar(text("PRAGMA journal_mode")) == "wal"
        assert connection.scalar(text("PRAGMA synchronous")) == 2  # FULL
    database.close()


def test_a_closed_log_is_one_file(kept):
    assert [file.name for file in kept.parent.iterdir()] == [kept.name]


def test_a_log_in_a_folder_that_cannot_be_written_to_is_read(kept, monkeypatch):
    access = os.access
    monkeypatch.setattr(os, "access", lambda where, mode: mode != os.W_OK and access(where, mode))
    with ReviewLog.open(kept) as log:
        assert [edit.event for edit in log.history()] == [FLAG]
        with pytest.raises(ReviewError, match="readonly"):
            log.append("walk", FLAG, "anna")
    assert [file.name for file in kept.parent.iterdir()] == [kept.name]


def test_the_tables_are_ones_that_postgresql_takes():
    for table in (EDITS, SCHEMA_VERSION):
        statement = str(CreateTable(table).compile(dialect=postgresql.dialect()))
        assert f"CREATE TABLE {table.name}" in statement
