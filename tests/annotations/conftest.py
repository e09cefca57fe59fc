"""Edits by hand, and a log in each kind of database."""

from datetime import UTC, datetime, timedelta

import pytest

from annotations.events import Edit
from annotations.log import ReviewLog
from tests.annotations.postgresql_server import postgresql  # noqa: F401 (a fixture)

FIRST = datetime(2024, 9, 1, 12, 0, tzinfo=UTC)


@pytest.fixture
def edits():
    """Makes the log of a trial 'walk' from (author, event) pairs, numbered from 1."""

    def numbered(*said):
        return tuple(
            Edit(number, "walk", author, FIRST + timedelta(minutes=number), event)
            for number, (author, event) in enumerate(said, start=1)
        )

    return numbered


@pytest.fixture
def path(tmp_path):
    """Of an SQLite file that is not there yet."""
    return tmp_path / "annotations.sqlite"


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request):
    """Where a log may be: a file that is not there yet, or the URL of an empty PostgreSQL schema."""
    if request.param == "sqlite":
        return request.getfixturevalue("path")
    return request.getfixturevalue("postgresql").new_place()


@pytest.fixture
def log(place):
    with ReviewLog.open(place) as opened:
        yield opened
