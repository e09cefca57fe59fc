"""The log on a disk: what is appended comes back, through restarts and from several hands at once."""

import multiprocessing
import threading
from datetime import UTC, datetime

import pytest
from sqlalchemy import text

from annotations.database import Database
from annotations.events import ClearRange, FlagRange, ImportLabels, ImportTable, Redo, SetStatus, Status, Undo
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError
from annotations.work import Comment

FLAG = FlagRange(10, 20, "notOverForcePlate", "calcn_r", "à côté")
FEET = ("calcn_r", "calcn_l")


def test_an_edit_comes_back_with_who_when_and_what(log):
    before = datetime.now(UTC)
    number = log.append("walk", FLAG, "anna")
    (edit,) = log.history("walk")
    assert (edit.number, edit.trial, edit.author, edit.event) == (number, "walk", "anna", FLAG)
    assert before <= edit.made_at <= datetime.now(UTC)
    assert edit.made_at.utcoffset().total_seconds() == 0


def test_trials_are_kept_apart(log):
    log.append("walk", FLAG, "anna")
    log.append("run", SetStatus(Status.FINISHED), "anna")
    assert log.trials() == ("run", "walk")
    assert log.review("run", FEET).flags == ()
    assert [edit.trial for edit in log.history()] == ["walk", "run"]
    with pytest.raises(ReviewError, match="jump: nothing of anna's to undo"):
        log.undo("jump", "anna")


def test_subjects_in_one_database_are_kept_apart(place):
    with ReviewLog.open(place, "S1") as first, ReviewLog.open(place, "S2") as second:
        first.append("walk", FLAG, "anna")
        assert second.history() == ()
        assert second.trials() == ()
        assert second.revision() == 0
        with pytest.raises(ReviewError, match="edit 1 is not one of this trial's"):
            second.append("walk", Undo(1), "anna")


def test_undo_and_redo_go_on_after_a_restart(place):
    with ReviewLog.open(place) as log:
        numbers = [log.append("walk", FlagRange(k, k + 1, "manualReview"), "anna") for k in range(3)]
        assert log.undo("walk", "anna").number == numbers[2]
    with ReviewLog.open(place) as log:
        assert log.undo("walk", "anna").number == numbers[1]
        assert [flag.start for flag in log.review("walk", FEET).flags] == [0]
    with ReviewLog.open(place) as log:
        assert log.redo("walk", "anna").number == numbers[1]
        assert log.redo("walk", "anna").number == numbers[2]
        assert [flag.start for flag in log.review("walk", FEET).flags] == [0, 1, 2]
        assert len(log.history("walk")) == 7


def test_a_reviewers_own_opinion_stands_on_what_was_imported(log):
    log.append("walk", ImportLabels(((0, 5),), 30, True), "imported")
    log.append("walk", FLAG, "anna")
    log.append("walk", ClearRange(0, 30), "ben")
    starts = {name: [f.start for f in log.review("walk", FEET, by=name).flags] for name in ("anna", "ben")}
    assert starts == {"anna": [0, 10], "ben": []}
    assert [f.start for f in log.review("walk", FEET, by="imported").flags] == [0]
    assert log.review("walk", FEET, by="anna").conflicts == ()


@pytest.mark.parametrize(
    ("event", "author", "said"),
    [
        (FLAG, " ", "needs an author's name"),
        (FLAG, "imported", "a person needs another name"),
        (ImportLabels((), 3, False), "anna", "'imported' stands for labels from files"),
        (Undo(1), "ben", "edit 1 is anna's, not ben's"),
        (Undo(7), "anna", "edit 7 is not one of this trial's"),
        (Redo(1), "anna", "nothing of anna's to redo"),
    ],
)
def test_a_wrong_edit_is_refused_and_leaves_no_trace(log, event, author, said):
    log.append("walk", FLAG, "anna")
    with pytest.raises(ReviewError, match=f"walk: .*{said}"):
        log.append("walk", event, author)
    assert len(log.history()) == 1


def test_an_edit_can_be_neither_changed_nor_removed(log, place):
    log.append("walk", FLAG, "anna")
    database = Database(place)
    log.work.append(["walk"], Comment("Mine."), "anna")
    for statement in (
        "UPDATE edits SET author = 'ben'",
        "DELETE FROM edits",
        "UPDATE work SET author = 'ben'",
        "DELETE FROM work",
    ):
        with pytest.raises(ReviewError, match="append-only"), database.writing() as connection:
            connection.execute(text(statement))
    database.close()
    assert [edit.author for edit in log.history()] == ["anna"]


def test_another_hand_sees_an_edit_at_once(log, place):
    with ReviewLog.open(place) as other:
        log.append("walk", FLAG, "anna")
        assert other.review("walk", FEET).flags[0].author == "anna"
        other.append("walk", ClearRange(10, 20, "calcn_r"), "ben")
        assert log.review("walk", FEET).flags == ()
        assert len(log.review("walk", FEET).conflicts) == 1


def append_many(place, author, count):
    with ReviewLog.open(place) as log:
        for k in range(count):
            log.append("walk", FlagRange(k, k + 1, "manualReview"), author)


def test_programs_that_open_a_new_log_at_once_lose_nothing(place):
    spawn = multiprocessing.get_context("spawn")
    authors = ("anna", "ben", "cleo")
    programs = [spawn.Process(target=append_many, args=(place, author, 30)) for author in authors]
    for program in programs:
        program.start()
    for program in programs:
        program.join()
        assert program.exitcode == 0
    with ReviewLog.open(place) as log:
        edits = log.history("walk")
    for author in authors:
        assert [edit.event.start for edit in edits if edit.author == author] == list(range(30))


def test_two_undos_at_once_take_back_two_edits(log, place):
    for k in range(40):
        log.append("walk", FlagRange(k, k + 1, "manualReview"), "anna")
    undone = []

    def undo():
        with ReviewLog.open(place) as own:
            undone.extend(own.undo("walk", "anna").number for _ in range(10))

    threads = [threading.Thread(target=undo) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(undone) == list(range(11, 41))


def test_a_revision_is_the_number_of_the_last_edit_whoever_made_it(log, place):
    assert log.revision() == 0
    log.append("walk", FLAG, "anna")
    seen = log.revision()
    with ReviewLog.open(place) as other:
        number = other.append("run", FLAG, "ben")
    assert log.revision() == number > seen
    assert [(edit.author, edit.trial) for edit in log.reading(after=seen).edits] == [("ben", "run")]
    assert [edit.author for edit in log.history()] == ["anna", "ben"]
    assert log.reading(after=number).edits == ()


def test_nothing_appears_behind_a_revision_that_was_seen(place):
    """Programs write while another one asks again and again what is new: it misses nothing."""
    spawn = multiprocessing.get_context("spawn")
    programs = [spawn.Process(target=append_many, args=(place, name, 40)) for name in ("anna", "ben", "cleo")]
    with ReviewLog.open(place) as log:
        for program in programs:
            program.start()
        seen, revision = [], 0
        while any(program.is_alive() for program in programs):
            new = [edit.number for edit in log.reading(after=revision).edits]
            seen, revision = seen + new, (new or [revision])[-1]
        seen += [edit.number for edit in log.reading(after=revision).edits]
        assert seen == [edit.number for edit in log.history()]
        assert len(seen) == 120


def test_the_last_import_of_each_kind(log):
    assert log.last_import("walk", ImportLabels) is None
    log.append("walk", ImportLabels((), 3, False), "imported")
    log.append("walk", ImportLabels(((0, 1),), 3, False), "imported")
    log.append("walk", ImportTable("S1.csv", "anna", ()), "imported")
    log.append("run", ImportLabels((), 9, True), "imported")
    assert log.last_import("walk", ImportLabels).event == ImportLabels(((0, 1),), 3, False)
    assert log.last_import("walk", ImportTable).event == ImportTable("S1.csv", "anna", ())


def test_a_log_is_taken_over_whole_into_a_shared_database(path, place):
    with ReviewLog.open(path.with_name("own.sqlite")) as own, ReviewLog.open(place, "S2") as shared:
        own.append("walk", FLAG, "anna")
        own.append("walk", ClearRange(0, 5), "ben")
        own.undo("walk", "anna")
        own.undo("walk", "ben")
        own.redo("walk", "anna")
        with ReviewLog.open(place, "S1") as others:
            others.append("walk", FLAG, "cleo")
        assert shared.take_over(own.history()) == 5
        assert shared.review("walk", FEET).flags[0].author == "anna"
        strip = [(e.trial, e.author, e.made_at, type(e.event)) for e in shared.history()]
        assert strip == [(e.trial, e.author, e.made_at, type(e.event)) for e in own.history()]
        assert shared.redo("walk", "ben").event == ClearRange(0, 5)
        with pytest.raises(ReviewError, match="has edits of 'S2' already; not copied"):
            shared.take_over(own.history())
        assert len(shared.history()) == 6


def test_logs_of_one_database_share_it(place):
    database = Database(place)
    with ReviewLog(database, "S1") as first:
        first.append("walk", FLAG, "anna")
    with ReviewLog(database, "S2") as second:  # the first one's end did not close it
        second.append("walk", FLAG, "ben")
        assert [edit.author for edit in second.history()] == ["ben"]
    database.close()
