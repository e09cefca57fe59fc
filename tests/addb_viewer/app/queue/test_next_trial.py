from addb_viewer.app.queue.rows import Row, next_trial, to_review
from annotations.events import Status

ROWS = [
    Row("S1", "a"),
    Row("S1", "b", Status.FINISHED),
    Row("S1", "c"),
    Row("S2", "a"),
    Row("S3", "", error="broken"),
]


def place(row):
    return None if row is None else (row.subject, row.trial)


def test_it_comes_after_the_present_one_and_then_from_the_top():
    assert place(next_trial(ROWS, ("S1", "a"), ())) == ("S1", "c")
    assert place(next_trial(ROWS, ("S1", "c"), ())) == ("S2", "a")
    assert place(next_trial(ROWS, ("S2", "a"), ())) == ("S1", "a")
    assert place(next_trial(ROWS, None, ())) == ("S1", "a")
    assert place(next_trial(ROWS, ("S9", "gone"), ())) == ("S1", "a")


def test_it_is_none_that_is_finished_or_broken_or_that_somebody_is_on():
    assert place(next_trial(ROWS, ("S1", "a"), {("S1", "c")})) == ("S2", "a")
    assert next_trial(ROWS, ("S1", "a"), {("S1", "c"), ("S2", "a")}) is None
    assert next_trial(ROWS[1:2], None, ()) is None
    assert next_trial([], ("S1", "a"), ()) is None


def test_what_is_still_to_be_reviewed_whoever_is_on_it():
    assert [place(row) for row in to_review(ROWS, ("S1", "a"))] == [("S1", "c"), ("S2", "a")]


def test_one_that_is_fitted_comes_before_one_that_is_not():
    rows = [*ROWS, Row("S4", "a", figures={"frames": 5}), Row("S4", "b", figures={"frames": 5})]
    assert place(next_trial(rows, ("S1", "a"), ())) == ("S4", "a")
    assert place(next_trial(rows, ("S1", "a"), {("S4", "a")})) == ("S4", "b")
    assert place(next_trial(rows, ("S1", "a"), {("S4", "a"), ("S4", "b")})) == ("S1", "c")
