"""Versions of the database: each step up to now, a failing step, and one from the future."""

import sqlite3

import pytest
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text

from annotations import schema
from annotations.database import Database
from annotations.errors import ReviewError
from annotations.events import FlagRange
from annotations.log import ReviewLog
from annotations.migrations.versions import v0002_shared

FLAG = FlagRange(10, 20, "manualReview")

# What the program made before Alembic kept the version, dumped from such a file.
FIRST = """
CREATE TABLE edits (
    number INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, subject VARCHAR NOT NULL, trial VARCHAR NOT NULL,
    author VARCHAR NOT NULL, made_at VARCHAR NOT NULL, kind VARCHAR NOT NULL, content JSON NOT NULL
);
CREATE INDEX edits_of_trial ON edits (subject, trial);
CREATE TRIGGER edits_no_UPDATE BEFORE UPDATE ON edits
BEGIN SELECT RAISE(ABORT, 'the review log is append-only'); END;
CREATE TRIGGER edits_no_DELETE BEFORE DELETE ON edits
BEGIN SELECT RAISE(ABORT, 'the review log is append-only'); END;
CREATE TABLE schema_version (version INTEGER NOT NULL);
INSERT INTO schema_version VALUES (1);
INSERT INTO edits VALUES (1, '', 'walk', 'anna', '2024-09-01T12:00:00+00:00', 'flag',
    '{"start": 10, "end": 20, "reason": "manualReview", "foot": null, "note": ""}');
"""


def shape(place):
    """Columns and indices of the table, and the version."""
    database = Database(place)
    try:
        with database.reading() as connection:
            found = inspect(connection)
            columns = {column["name"] for column in found.get_columns("edits")}
            indices = {index["name"]: index["column_names"] for index in found.get_indexes("edits")}
            version = connection.scalar(text(f"SELECT version_num FROM {schema.VERSION_TABLE}"))
            return columns, indices, version
    finally:
        database.close()


@pytest.fixture
def first(path):
    with sqlite3.connect(path) as raw:
        raw.executescript(FIRST)
    raw.close()
    return path


def test_the_steps_make_the_table_that_the_program_uses(place):
    columns, indices, version = shape(place)
    assert columns == {column.name for column in schema.EDITS.columns}
    assert indices == {
        index.name: [column.name for column in index.columns] for index in schema.EDITS.indexes
    }
    assert version == schema.VERSION


def test_the_version_is_that_of_the_last_step():
    config = Config()
    config.set_main_option("script_location", "annotations:migrations")
    script = ScriptDirectory.from_config(config)
    assert script.get_heads() == [schema.VERSION]
    steps = [step.revision for step in script.walk_revisions()]
    assert steps == sorted(steps, reverse=True)  # so that a later one is the greater


def test_a_database_of_the_first_version_is_brought_up_to_date_and_keeps_its_edits(first, tmp_path):
    with ReviewLog.open(first) as log:
        assert [edit.event for edit in log.history()] == [FLAG]
        assert log.append("walk", FLAG, "ben") == 2
    assert shape(first) == shape(tmp_path / "new.sqlite")
    with sqlite3.connect(first) as raw:
        assert raw.execute("SELECT version FROM schema_version").fetchall() == [(2,)]  # older ones refuse it
    raw.close()


def test_a_database_of_the_first_version_is_read_where_nothing_can_be_written(first, tmp_path, read_only):
    folder = tmp_path / "subject"
    folder.mkdir()
    first.rename(folder / first.name)
    with ReviewLog.open(read_only(folder) / first.name) as log:
        assert [edit.event for edit in log.history()] == [FLAG]
    with sqlite3.connect(folder / first.name) as raw:
        assert raw.execute("SELECT version FROM schema_version").fetchall() == [(1,)]
    raw.close()


def test_a_step_that_fails_leaves_the_database_as_it_was(first, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(v0002_shared.op, "create_index", _power_cut)
        with pytest.raises(RuntimeError, match="power cut"):
            ReviewLog.open(first)
    with sqlite3.connect(first) as raw:
        assert raw.execute("SELECT version FROM schema_version").fetchall() == [(1,)]
        assert not raw.execute(
            "SELECT 1 FROM sqlite_master WHERE name = ?", [schema.VERSION_TABLE]
        ).fetchall()
    raw.close()
    with ReviewLog.open(first) as log:
        assert len(log.history()) == 1


def _power_cut(*_):
    raise RuntimeError("power cut")


def test_a_database_of_a_newer_version_is_refused_untouched(place):
    with ReviewLog.open(place) as log:
        log.append("walk", FLAG, "anna")
    database = Database(place)
    with database.writing() as connection:
        connection.execute(text(f"UPDATE {schema.VERSION_TABLE} SET version_num = '0099'"))
    with pytest.raises(
        ReviewError, match=r": made by a newer version of addb-viewer \(schema 0099;.*update addb-viewer"
    ):
        ReviewLog.open(place)
    with database.reading() as connection:
        assert connection.scalar(text(f"SELECT version_num FROM {schema.VERSION_TABLE}")) == "0099"
    database.close()
