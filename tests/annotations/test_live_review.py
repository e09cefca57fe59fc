"""The review in memory: kept up with other programs, folded only when there is something new."""

import threading

import pytest

from annotations import live_review
from annotations.events import ClearRange, FlagRange, ImportLabels, SetStatus, Status
from annotations.live_review import LiveReview
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError

FEET = ("calcn_r", "calcn_l")
FLAG = FlagRange(10, 20, "notOverForcePlate", "calcn_r")


@pytest.fixture
def live(log):
    log.append("walk", FLAG, "anna")
    return LiveReview(log, FEET)


def test_it_shows_what_the_log_says(live, log):
    live.log.append("run", SetStatus(Status.FINISHED), "anna")
    live.refresh()
    assert live.review("walk") == log.review("walk", FEET)
    assert dict(live.reviews()) == {trial: log.review(trial, FEET) for trial in ("run", "walk")}
    assert live.history("walk") == log.history("walk")
    assert live.review("jump").status is Status.UNSEEN


def test_another_programs_edit_is_there_after_a_refresh(live, place):
    seen = live.revision
    with ReviewLog.open(place) as other:
        number = other.append("walk", ClearRange(15, 30), "ben")
        other.append("run", ClearRange(0, 1), "ben")
    assert live.review("walk").conflicts == ()
    assert live.refresh() == live.revision == number + 1
    assert [edit.author for edit in live.since(seen)] == ["ben", "ben"]
    assert [edit.number for edit in live.since(seen, "walk")] == [number]
    assert live.since(live.revision) == ()
    assert len(live.review("walk").conflicts) == 1


def test_readers_remember_for_themselves_what_they_have_seen(live):
    numbers = [live.log.append("walk", ClearRange(k, k + 1), "anna") for k in range(4)]
    live.refresh()
    assert [edit.number for edit in live.since(numbers[1])] == numbers[2:]
    assert [edit.number for edit in live.since(0)] == [numbers[0] - 1, *numbers]


def test_a_trial_is_folded_once_for_each_of_its_edits(live, monkeypatch):
    folds = []
    monkeypatch.setattr(live_review, "review_of", lambda trial, *_: folds.append(trial))
    for _ in range(3):
        live.review("walk")
    live.log.append("run", FLAG, "anna")
    live.refresh()
    live.review("walk")
    assert folds == ["walk"]
    live.log.append("walk", FLAG, "anna")
    live.refresh()
    live.review("walk")
    assert folds == ["walk", "walk"]


def test_one_reviewers_opinion(live):
    live.log.append("walk", ImportLabels(((0, 5),), 30, False), "imported")
    live.log.append("walk", ClearRange(0, 30), "ben")
    live.refresh()
    assert [flag.start for flag in live.review("walk", by="anna").flags] == [0, 10]
    assert live.review("walk", by="ben").flags == ()
    assert live.review("walk").flags == ()


def test_a_log_that_fails_leaves_what_was_known(live, monkeypatch):
    def fail(**_):
        raise ReviewError("the disk is gone")

    monkeypatch.setattr(live.log, "reading", fail)
    with pytest.raises(ReviewError, match="the disk is gone"):
        live.refresh()
    assert len(live.review("walk").flags) == 1


def test_threads_share_it(live):
    def edit(author):
        for k in range(15):
            live.log.append("walk", FlagRange(k, k + 1, "manualReview"), author)
            live.refresh()
            live.review("walk")

    threads = [threading.Thread(target=edit, args=(name,)) for name in ("ben", "cleo", "dora")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    live.refresh()
    assert live.since(0) == live.log.history()
    assert len(live.since(0)) == 46
