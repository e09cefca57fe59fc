"""Edits by hand, and a log on a temporary disk."""

from datetime import UTC, datetime, timedelta

import pytest

from annotations.events import Edit
from annotations.log import ReviewLog

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
    return tmp_path / "annotations.sqlite"


@pytest.fixture
def log(path):
    with ReviewLog.open(path) as opened:
        yield opened
