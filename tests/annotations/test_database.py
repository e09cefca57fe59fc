"""The database behind the log: what it refuses, and how it waits."""

import sqlite3
import threading
import time

import pytest
from sqlalchemy import text

from annotations.database import Database
from annotations.events import FlagRange
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError
from tests.patience import PATIENCE_S

FLAG = FlagRange(10, 20, "manualReview")
BUSY = "another program has been writing to it for 0.2 s; nothing was recorded"


@pytest.fixture
def kept(path):
    """A log with one edit, closed."""
    with ReviewLog.open(path) as log:
        log.append("walk", FLAG, "anna")
    return path


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


@pytest.mark.parametrize(
    ("url", "said"),
    [
        (
            "nosuch://anna:secret@localhost/lab",
            r"nosuch://anna:\*\*\*@localhost/lab: .*a review store is a postgresql://",
        ),
        (
            "mysql://anna:secret@localhost/lab",
            r"mysql://anna:\*\*\*@localhost/lab: .*a review store is a postgresql://",
        ),
        ("postgresql://anna:secret@localhost:lab", "the URL of the review store cannot be read; write"),
        (
            "postgresql://anna:secret@/lab?host=/no/such/folder",
            r"anna:\*\*\*@.*the review log cannot be used",
        ),
        ("://anna:secret", "the URL of the review store cannot be read; write"),
    ],
)
def test_a_url_that_leads_nowhere_is_named_without_its_password(url, said):
    with pytest.raises(ReviewError, match=said) as failure:
        ReviewLog.open(url)
    assert "secret" not in str(failure.value)


def test_who_finds_the_database_busy_waits_and_then_hears_so_in_words(place):
    with ReviewLog.open(place, patience_s=0.2) as log:
        other = Database(place)
        with other.writing():
            started = time.monotonic()
            with pytest.raises(ReviewError, match=BUSY):
                log.append("walk", FLAG, "anna")
            assert time.monotonic() - started >= 0.2
            assert log.history() == ()
        log.append("walk", FLAG, "anna")
        assert len(log.history()) == 1
        other.close()


def test_who_finds_the_database_busy_goes_on_when_it_is_free(place):
    with ReviewLog.open(place) as log:
        other = Database(place)
        with other.writing():
            waiting = threading.Thread(target=log.append, args=("walk", FLAG, "anna"))
            waiting.start()
            waiting.join(0.3)
            assert waiting.is_alive()
        waiting.join(PATIENCE_S)
        assert len(log.history()) == 1
        other.close()


def test_a_file_that_another_program_holds_alone_is_said_to_be_busy(kept):
    holder = sqlite3.connect(kept)
    holder.execute("PRAGMA locking_mode = EXCLUSIVE")
    holder.execute("BEGIN EXCLUSIVE")
    with pytest.raises(ReviewError, match=BUSY):
        ReviewLog.open(kept, patience_s=0.2)
    holder.close()


def test_a_commit_waits_for_the_disk_whatever_the_server_does_by_default(postgresql):
    database = Database(f"{postgresql.new_place()}%20-csynchronous_commit%3Doff")
    with database.reading() as connection:
        assert connection.scalar(text("SHOW synchronous_commit")) == "off"
    with database.writing() as connection:
        assert connection.scalar(text("SHOW synchronous_commit")) == "on"
    database.close()


def test_what_is_written_is_synchronized_to_the_disk(path):
    database = Database(path)
    with database.reading() as connection:
        assert connection.scalar(text("PRAGMA journal_mode")) == "wal"
        assert connection.scalar(text("PRAGMA synchronous")) == 2  # FULL
    database.close()


def test_a_closed_log_is_one_file(kept):
    assert [file.name for file in kept.parent.iterdir()] == [kept.name]


def test_whoever_opens_a_new_log_first_the_others_wait(tmp_path):
    """SQLite refuses a second switch to the write-ahead log at once; about one round in 25 met that."""
    failures = []

    def first_edit(path, together):
        together.wait()
        try:
            with ReviewLog.open(path) as log:
                log.append("walk", FLAG, "anna")
        except ReviewError as error:
            failures.append(str(error))

    for k in range(100):
        path, together = tmp_path / f"{k}.sqlite", threading.Barrier(3)
        threads = [threading.Thread(target=first_edit, args=(path, together)) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert failures == []
