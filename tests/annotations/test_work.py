"""Who is to review a trial, and comments: what is said comes back, stays, and decides nothing."""

import pytest
from sqlalchemy import text

from annotations.database import Database
from annotations.events import FlagRange
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError
from annotations.work import LONGEST_NAME, LONGEST_TEXT, Assign, Comment, Settle, work_of


def state(log, trial="walk"):
    return work_of([item for item in log.work.reading()[0] if item.trial == trial])


def test_many_trials_are_assigned_at_once_and_one_is_given_back(log):
    log.work.append(["walk", "run", "jump"], Assign("ben"), "anna")
    log.work.append(["run"], Assign(""), "ben")
    found = {trial: state(log, trial) for trial in ("walk", "run", "jump", "squat")}
    assert {trial: work.assigned_to for trial, work in found.items()} == {
        "walk": "ben",
        "run": "",
        "jump": "ben",
        "squat": "",
    }
    assert found["walk"].assigned_by == "anna"


def test_a_comment_is_answered_settled_and_opened_again_by_a_further_answer(log):
    (first,) = log.work.append(["walk"], Comment("Is that a stumble?", frame=57), "anna")
    log.work.append(["walk"], Comment("Yes, see the video.", answers=first), "ben")
    log.work.append(["walk"], Comment("The whole trial is slow."), "ben")
    comment_thread, other = state(log).comments
    assert (comment_thread.frame, other.frame) == (57, None)
    assert [(item.author, item.event.text) for item in comment_thread.answers] == [
        ("ben", "Yes, see the video.")
    ]
    assert state(log).open_comments == 2
    log.work.append(["walk"], Settle(first), "anna")
    assert state(log).comments[0].settled_by == "anna"
    assert state(log).open_comments == 1
    log.work.append(["walk"], Comment("No, look again.", answers=first), "ben")
    assert state(log).open_comments == 2


@pytest.mark.parametrize("event", [Comment("?", answers=1), Settle(1), Comment("?", answers=99), Settle(99)])
def test_only_a_comment_thread_of_the_same_trial_is_answered_or_settled(log, event):
    log.work.append(["walk"], Comment("Is that a stumble?"), "anna")
    with pytest.raises(ReviewError, match="run: has no comment"):
        log.work.append(["run"], event, "ben")
    assert len(log.work.reading()[0]) == 1


def test_what_is_said_about_several_trials_is_said_about_all_or_none(log, monkeypatch):
    inserted = log.work._insert

    def break_at_the_second(connection, trial, *arguments):
        if trial == "run":
            raise OSError("power cut")
        return inserted(connection, trial, *arguments)

    monkeypatch.setattr(log.work, "_insert", break_at_the_second)
    with pytest.raises(OSError, match="power cut"):
        log.work.append(["walk", "run"], Assign("ben"), "anna")
    assert log.work.reading() == ((), ())


def test_it_is_no_edit_makes_no_trial_in_work_and_is_not_undone(log):
    log.append("walk", FlagRange(10, 20, "manualReview"), "anna")
    log.work.append(["walk", "run"], Comment("Look at frame 12."), "anna")
    log.work.append(["run"], Assign("anna"), "anna")
    assert log.trials() == ("walk",)
    assert log.undo("walk", "anna").event == FlagRange(10, 20, "manualReview")
    assert len(log.work.reading()[0]) == 3


def test_subjects_and_their_revisions_are_kept_apart_and_outlive_the_program(place):
    with ReviewLog.open(place, "S1") as first, ReviewLog.open(place, "S2") as second:
        numbers = first.work.append(["walk", "run"], Assign("ben"), "anna")
        assert (first.work.revision(), second.work.revision()) == (numbers[-1], 0)
    with ReviewLog.open(place, "S1") as again:
        assert [item.number for item in again.work.reading()[0]] == list(numbers)


BROKEN = {
    "kind": ("praise", '{"text": "x"}', "newer version"),
    "truth for a number": ("comment", '{"text": "x", "frame": true}', "'frame' is not a whole number"),
    "nothing": ("settle", "{}", "does not say all"),
    "empty": ("comment", '{"text": " "}', "needs words"),
}  # what else can be wrong is read as in edits


@pytest.mark.parametrize("case", BROKEN)
def test_a_row_that_cannot_be_read_hides_no_other(path, case):
    kind, content, why = BROKEN[case]
    with ReviewLog.open(path) as log:
        log.work.append(["walk"], Comment("whole"), "anna")
        database = Database(path)
        with database.writing() as connection:
            connection.execute(
                text(
                    "INSERT INTO work (subject, trial, author, made_at, kind, content) "
                    "VALUES ('', 'walk', 'eve', '2026-01-01T00:00:00+00:00', :kind, :content)"
                ),
                {"kind": kind, "content": content},
            )
        database.close()
        log.work.append(["walk"], Assign("ben"), "anna")
        items, (row,) = log.work.reading()
    assert [item.number for item in items] == [1, 3]
    assert why in row.why
    assert (row.number, row.author) == (2, "eve")


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Comment("  "),
        lambda: Comment("x" * (LONGEST_TEXT + 1)),
        lambda: Comment("x", frame=-1),
        lambda: Assign(" ben"),
        lambda: Assign("x" * (LONGEST_NAME + 1)),
    ],
)
def test_what_says_nothing_or_too_much_is_refused(wrong):
    with pytest.raises(ReviewError):
        wrong()


def test_a_persons_name_is_needed(log):
    for author in ("", " ", "imported"):
        with pytest.raises(ReviewError, match="name is needed"):
            log.work.append(["walk"], Assign("ben"), author)


def test_all_is_copied_into_another_log_with_authors_dates_and_answers(place, tmp_path):
    with ReviewLog.open(tmp_path / "own.sqlite") as own, ReviewLog.open(place, "S1") as shared:
        own.work.append(["run"], Assign("ben"), "anna")
        (first,) = own.work.append(["walk"], Comment("?", frame=3), "anna")
        own.work.append(["walk"], Comment("!", answers=first), "ben")
        own.work.append(["walk"], Settle(first), "anna")
        with ReviewLog.open(place, "S2") as other:
            other.work.append(["walk"], Comment("of another subject"), "eve")
        shared.work.take_over(own.work.reading()[0])
        copied = state(shared)
        assert [item.event.text for item in copied.comments[0].answers] == ["!"]
        assert copied.comments[0].settled_by == "anna"
        assert copied.comments[0].first.made_at == state(own).comments[0].first.made_at
        assert state(shared, "run").assigned_to == "ben"
        with pytest.raises(ReviewError, match="has comments of 'S1' already"):
            shared.work.take_over(own.work.reading()[0])
