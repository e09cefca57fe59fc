"""Edits of an MCAP file put back into a store."""

import json
from dataclasses import replace

import pytest
from mcap.writer import Writer

from addb_viewer.recordings.mcap_recording import EDITS_TOPIC, write_mcap
from addb_viewer.recordings.restoring import edits_in, restore
from annotations.errors import ReviewError
from annotations.events import FlagRange, Redo, SetStatus, Status, Undo
from annotations.log import ReviewLog
from solver.common.errors import ResultsError


@pytest.fixture
def log(tmp_path):
    with ReviewLog.open(tmp_path / "annotations.sqlite") as log:
        yield log


def told(log):
    return [(e.trial, e.author, e.event) for e in log.history()]


def test_an_empty_store_gets_everything_with_authors_and_dates(recording, edits, log, tmp_path):
    done = restore(edits_in(write_mcap(recording, tmp_path / "walk.mcap")), log)
    assert (done.added, done.there, done.with_dates) == (3, 0, True)
    assert [e.made_at for e in log.history()] == [e.made_at for e in edits]
    assert [e.author for e in log.history()] == ["anna", "ben", "ben"]
    assert log.history()[2].event == Undo(log.history()[1].number)


def test_a_second_time_changes_nothing(edits, log):
    restore(edits, log)
    before = log.history()
    done = restore(edits, log)
    assert (done.added, done.there) == (0, 3)
    assert log.history() == before


def test_only_what_is_missing_comes_behind_what_is_there(edits, log):
    log.append("walk", SetStatus(Status.IN_WORK), "cleo")
    log.append("walk", edits[0].event, "anna")
    done = restore(edits, log)
    assert (done.added, done.there, done.with_dates) == (2, 1, False)
    added = log.history()[2:]
    assert [e.author for e in added] == ["ben", "ben"]
    assert added[1].event == Undo(added[0].number)
    assert restore(edits, log).added == 0


def test_the_review_is_the_same_as_before_the_loss(edits, log, tmp_path):
    more = (*edits, replace(edits[2], number=9, event=Redo(4)))
    with ReviewLog.open(tmp_path / "lost.sqlite") as lost:
        lost.take_over(more)
        expected = lost.review("walk", ("calcn_r",))
        restore(lost.history(), log)
    found = log.review("walk", ("calcn_r",))
    assert found.missing_ranges == expected.missing_ranges
    assert len(found.missing_ranges) == 2, "split by the frame that ben cleared again"


def test_the_same_flag_twice_is_two_edits(edits, log):
    twice = (edits[0], replace(edits[0], number=5))
    log.append("walk", edits[0].event, "anna")
    done = restore(twice, log)
    assert (done.added, done.there) == (1, 1)


def test_an_undo_of_what_the_file_lacks_is_refused(edits, log):
    log.append("walk", FlagRange(0, 3, "forceDiscrepancy"), "cleo")
    with pytest.raises(ReviewError, match="undoes edit 4"):
        restore(edits[2:], log)


EDIT = {
    "number": 1,
    "trial": "walk",
    "author": "anna",
    "made_at": "2024-09-01T12:00:00+00:00",
    "kind": "clear",
    "content": {"start": 0, "end": 3},
}


@pytest.mark.parametrize(
    "told",
    [
        json.dumps({**EDIT, "number": "1"}),
        json.dumps({**EDIT, "trial": ["walk"]}),
        json.dumps({**EDIT, "author": None}),
        json.dumps({**EDIT, "made_at": "yesterday"}),
        json.dumps({**EDIT, "made_at": 5}),
        json.dumps({**EDIT, "content": [1]}),
        json.dumps({**EDIT, "content": {"start": "0", "end": 3}}),
        json.dumps({**EDIT, "kind": {}}),
        json.dumps([1]),
        "[" * 5000,
        '{"number": ' + "1" * 5000 + "}",
    ],
)
def test_an_edit_in_a_file_that_is_none_is_told_with_the_file(tmp_path, told):
    file = tmp_path / "session.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(EDITS_TOPIC, "json", 0)
        for number, text in enumerate((json.dumps({**EDIT, "number": 2}), told)):
            writer.add_message(channel, number, text.encode(), number)
        writer.finish()
    with pytest.raises((ReviewError, ResultsError), match=f"{file.name}: {EDITS_TOPIC}: "):
        edits_in(file)
