"""The tables of the database: made whole or not at all, and those of another version are refused."""

import pytest
from sqlalchemy import text

from annotations import schema
from annotations.database import Database
from annotations.events import FlagRange
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError

FLAG = FlagRange(10, 20, "manualReview")


def test_tables_that_fail_half_way_leave_nothing(place, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(schema, "_forbidding", lambda *_: ["no statement"])
        with pytest.raises(ReviewError):
            ReviewLog.open(place)
    database = Database(place)
    with ReviewLog(database, "") as log:
        log.append("walk", FLAG, "anna")
    with pytest.raises(ReviewError, match="append-only"), database.writing() as connection:
        connection.execute(text("DELETE FROM edits"))  # had the version stayed, nothing would forbid it
    database.close()


def test_a_database_of_another_version_is_refused_untouched(place):
    with ReviewLog.open(place) as log:
        log.append("walk", FLAG, "anna")
    database = Database(place)
    with database.writing() as connection:
        connection.execute(text(f"UPDATE {schema.VERSION_TABLE} SET version_num = '0099'"))
    with pytest.raises(
        ReviewError, match=r": made by another version of addb-viewer \(schema 0099;.*update addb-viewer"
    ):
        ReviewLog.open(place)
    with database.reading() as connection:
        assert connection.scalar(text(f"SELECT version_num FROM {schema.VERSION_TABLE}")) == "0099"
    database.close()
