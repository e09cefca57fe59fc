"""A row that nobody can read is passed over and told; everything else is read and written as ever."""

import json
import sqlite3

import numpy as np
import pytest
from sqlalchemy import text

from annotations.database import Database
from annotations.events import ClearRange, FlagRange, ImportLabels, Redo, SetStatus, Status, Undo
from annotations.live_review import LiveReview
from annotations.log import ReviewLog
from annotations.review_errors import LostLogError, ReviewError
from annotations.review_json import import_labels

FLAG = FlagRange(10, 20, "notOverForcePlate", "calcn_r", "à côté")
FEET = ("calcn_r", "calcn_l")
CONTENT = {"start": 3, "end": 9, "reason": "missingBlip", "foot": None, "note": ""}
PROPOSAL = {**CONTENT, "confidence": 0.5, "evidence": {}, "detector": "d"}
PROPOSAL.pop("note")
DATE = "2024-09-01T12:00:00+00:00"


def deep(levels):
    return '{"start": ' + "[" * levels + "]" * levels + "}"


BAD = {
    "a date that is none": ("flag", CONTENT, "yesterday"),
    "a date before there was a program": ("flag", CONTENT, "0001-01-01T00:00:00+14:00"),
    "a list": ("flag", [1, 2], DATE),
    "nested deep": ("flag", deep(5000), DATE),
    "an unknown kind": ("merge", CONTENT, DATE),
    "an unknown field": ("flag", {**CONTENT, "sure": 1}, DATE),
    "a field too few": ("flag", {"start": 3}, DATE),
    "an unknown reason": ("flag", {**CONTENT, "reason": "because"}, DATE),
    "a frame as text": ("flag", {**CONTENT, "start": "3"}, DATE),
    "a frame that is true": ("clear", {"start": True, "end": 2}, DATE),
    "no frames": ("clear", {"start": 5, "end": 2}, DATE),
    "more frames than memory": ("clear", {"start": 0, "end": 10**15}, DATE),
    "a number of 5000 digits": ("clear", '{"start": 0, "end": ' + "1" * 5000 + "}", DATE),
    "a foot that is a list": ("flag", {**CONTENT, "foot": ["calcn_r"]}, DATE),
    "a note that cannot be printed": ("flag", json.dumps({**CONTENT, "note": "\ud800"}), DATE),
    "a proposal that is a text": ("accept proposal", {"proposal": "it"}, DATE),
    "a confidence in words": ("accept proposal", {"proposal": {**PROPOSAL, "confidence": "high"}}, DATE),
    "evidence in words": ("accept proposal", {"proposal": {**PROPOSAL, "evidence": {"gap_N": "big"}}}, DATE),
    "evidence as a list": ("reject proposal", {"proposal": {**PROPOSAL, "evidence": [1]}}, DATE),
    "an unknown status": ("status", {"status": "forgotten"}, DATE),
    "no status": ("status", {"status": None}, DATE),
    "proposals that are a text": ("status", {"status": "finished", "left_out": "all"}, DATE),
    "an unknown activity": ("activity", {"start": 0, "end": 3, "activity": "fly"}, DATE),
    "an undo of a text": ("undo", {"edit": "1"}, DATE),
}
IMPORTS = {
    "a range of one frame": {"missing": [[1]], "frames": 3, "finished": False},
    "a range behind the end": {"missing": [[1, 9]], "frames": 3, "finished": False},
    "finished in words": {"missing": [], "frames": 3, "finished": "yes"},
    "more frames than memory": {"missing": [], "frames": 10**13, "finished": True},
}
INSERT = (
    "INSERT INTO edits (subject, trial, author, made_at, kind, content) "
    "VALUES (:subject, :trial, :author, :made_at, :kind, :content)"
)
WHOLE = "SELECT number, trial, author, made_at, kind, CAST(content AS TEXT) FROM edits ORDER BY number"


@pytest.fixture
def write(place):
    """Puts a row into the log by hand, as no program of ours does; gives its number."""
    database = Database(place)

    def written(kind="merge", content=CONTENT, made_at=DATE, author="anna", trial="walk"):
        content = content if isinstance(content, str) and content[:1] in "{[" else json.dumps(content)
        row = {"subject": "", "trial": trial, "author": author, "made_at": made_at, "kind": kind}
        with database.writing() as connection:
            connection.execute(text(INSERT), {**row, "content": content})
            return connection.execute(text("SELECT max(number) FROM edits")).scalar()

    yield written
    database.close()


@pytest.fixture
def stored(place):
    """All that lies in the table, as it lies there."""
    database = Database(place)

    def rows():
        with database.reading() as connection:
            return [tuple(row) for row in connection.execute(text(WHOLE))]

    yield rows
    database.close()


@pytest.mark.parametrize("bad", BAD.values(), ids=BAD.keys())
def test_a_bad_row_is_passed_over_told_and_left_as_it_is(log, write, stored, bad):
    log.append("walk", FLAG, "anna")
    number = write(*bad)
    after = log.append("walk", ClearRange(30, 40), "ben")
    before = stored()
    assert [edit.number for edit in log.history("walk")] == [number - 1, after]
    (row,) = log.unreadable("walk")
    assert (row.number, row.trial, row.author) == (number, "walk", "anna")
    assert row.why
    assert log.unreadable() == (row,)
    review = log.review("walk", FEET)
    assert review.unreadable == (row,)
    assert [flag.edit for flag in review.flags] == [number - 1]
    assert log.review("walk", FEET, by="ben").unreadable == ()
    assert log.trials() == ("walk",)
    assert log.revision() == after
    assert stored() == before


@pytest.mark.parametrize("content", IMPORTS.values(), ids=IMPORTS.keys())
def test_a_bad_import_is_passed_over_and_the_file_is_taken_in_again(log, write, content):
    number = write("import", content, author="imported")
    assert [row.number for row in log.unreadable("walk")] == [number]
    assert log.last_import("walk", ImportLabels) is None
    labels = np.array([True, False, False])
    assert import_labels(log, "walk", labels, finished=True) == number + 1
    assert import_labels(log, "walk", labels, finished=True) is None
    assert log.review("walk", FEET).status is Status.FINISHED


def test_an_import_that_can_be_read_is_found_before_one_that_cannot(log, write):
    log.append("walk", ImportLabels(((0, 1),), 3, False), "imported")
    write("import", {"missing": 4}, author="imported")
    assert log.last_import("walk", ImportLabels).event == ImportLabels(((0, 1),), 3, False)


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ({"kind": "merge"}, "kind 'merge', written by a newer version; update addb-viewer"),
        ({"kind": "flag", "made_at": "yesterday"}, "its date 'yesterday' is none"),
        ({"kind": "flag", "content": [1]}, "not a JSON object"),
        ({"kind": "flag", "content": deep(5000)}, "nested too deeply"),
        ({"kind": "flag", "content": {**CONTENT, "end": "9"}}, "its 'end' is not a whole number"),
        ({"kind": "flag", "content": {**CONTENT, "w": 1}}, "says 'w', which this version does not know"),
        ({"kind": "import", "content": {}}, "does not say all of missing, frames, finished"),
        ({"kind": "flag", "author": "imported"}, "a person needs another name"),
    ],
)
def test_why_it_cannot_be_read_is_told(log, write, bad, said):
    number = write(**bad)
    (row,) = log.unreadable()
    assert said in row.why
    assert str(row).startswith(f"row {number} by {row.author} of the review log cannot be read: ")


def test_a_date_without_a_zone_is_utc(log, write):
    write("flag", made_at="2024-09-01T12:00:00")
    (edit,) = log.history()
    assert edit.made_at.isoformat() == DATE


@pytest.mark.parametrize("broken", ['{"start": 1', "", "{'start': 1}", "\x00", "NaN"])
def test_sqlite_keeps_what_is_no_json_and_it_is_passed_over(path, broken):
    with ReviewLog.open(path) as log:
        log.append("walk", FLAG, "anna")
        _insert(path, content=broken)
        assert [row.number for row in log.unreadable()] == [2]
        assert [edit.number for edit in log.history()] == [1]


@pytest.mark.parametrize("column", ["trial", "author", "made_at", "kind", "content"])
@pytest.mark.parametrize("value", [b"\xff\xfe", "CAST(x'fffe' AS TEXT)"])
def test_bytes_that_are_no_text_spoil_their_row_alone(path, column, value):
    with ReviewLog.open(path) as log:
        log.append("walk", FLAG, "anna")
        _insert(path, **{column: value})
        log.append("walk", ClearRange(30, 40), "ben")
        assert [edit.number for edit in log.history()] == [1, 3]
        (row,) = log.unreadable()
        assert (row.number, row.why) == (2, f"its {column} is not UTF-8 text")
        str(row).encode()
        assert row.may_be_about("walk")
        assert row.may_be_about("run") is (column == "trial")
        assert row.may_be_of("ben") is (column == "author")
        assert log.trials() == ("walk",)
        live = LiveReview(log, FEET)
        assert live.refresh() == 3


def _insert(path, **values):
    row = {"subject": "", "trial": "walk", "author": "anna", "made_at": DATE, "kind": "flag"}
    row |= {"content": json.dumps(CONTENT), **values}
    said = {name: value for name, value in row.items() if not str(value).startswith("CAST(")}
    places = [f":{name}" if name in said else str(row[name]) for name in row]
    with sqlite3.connect(path) as connection:
        connection.execute(f"INSERT INTO edits ({', '.join(row)}) VALUES ({', '.join(places)})", said)
    connection.close()


def test_a_trial_with_nothing_but_a_row_that_nobody_can_read_is_not_unseen(log, write):
    write()
    review = log.review("walk", FEET)
    assert (review.status, review.status_author, review.decided) == (Status.IN_WORK, None, False)
    assert log.review("run", FEET).status is Status.UNSEEN


def test_a_finished_trial_stays_finished_and_says_what_cannot_be_read(log, write):
    log.append("walk", SetStatus(Status.FINISHED, left_out=()), "anna")
    write()
    review = log.review("walk", FEET)
    assert review.status is Status.FINISHED
    assert len(review.unreadable) == 1


def test_undo_does_not_go_back_beyond_a_row_that_may_be_about_it(log, write):
    first = log.append("walk", FLAG, "anna")
    bad = write()
    second = log.append("walk", ClearRange(0, 3), "anna")
    assert log.undo("walk", "anna").number == second
    with pytest.raises(
        ReviewError, match=f"walk: row {bad} by anna cannot be read, so undo does not go back"
    ):
        log.undo("walk", "anna")
    assert [flag.edit for flag in log.review("walk", FEET).flags] == [first]
    log.append("walk", Undo(first), "anna")
    assert log.review("walk", FEET).flags == ()


def test_another_persons_unreadable_row_is_no_hindrance(log, write):
    first = log.append("walk", FLAG, "anna")
    write(author="ben")
    assert log.undo("walk", "anna").number == first
    assert log.redo("walk", "anna").number == first


def test_redo_does_not_reach_behind_an_unreadable_row(log, write):
    first = log.append("walk", FLAG, "anna")
    log.undo("walk", "anna")
    bad = write()
    with pytest.raises(
        ReviewError, match=f"row {bad} by anna cannot be read, so neither it nor anything before it"
    ):
        log.redo("walk", "anna")
    with pytest.raises(
        ReviewError, match=f"row {bad} by anna cannot be read, so neither it nor anything before it"
    ):
        log.append("walk", Redo(first), "anna")
    assert log.review("walk", FEET).flags == ()


def test_an_unreadable_row_is_neither_undone_nor_redone(log, write):
    bad = write()
    with pytest.raises(ReviewError, match=f"row {bad} by anna cannot be read .*cannot be undone"):
        log.append("walk", Undo(bad), "anna")
    write("undo", {"edit": bad})
    with pytest.raises(
        ReviewError, match=f"row {bad} by anna cannot be read, so neither it nor anything before it"
    ):
        log.redo("walk", "anna")
    first = log.append("walk", FLAG, "anna")
    assert log.undo("walk", "anna").number == first
    with pytest.raises(ReviewError, match="nothing of anna's to undo"):  # the row was taken back long ago
        log.undo("walk", "anna")


def test_a_redo_whose_undo_cannot_be_read_changes_nothing(log, write):
    first = log.append("walk", FLAG, "anna")
    write("undo", {"edit": "?"})
    write("redo", {"edit": first})
    with pytest.raises(ReviewError, match="cannot be read, so neither it nor anything before it"):
        log.redo("walk", "anna")
    assert [flag.edit for flag in log.review("walk", FEET).flags] == [first]


def test_a_copy_has_what_can_be_read_and_no_undo_of_what_cannot(path, postgresql):
    with ReviewLog.open(path) as own, ReviewLog.open(postgresql.new_place(), "S1") as shared:
        own.append("walk", FLAG, "anna")
        _insert(path, kind="merge")
        _insert(path, kind="undo", content='{"edit": 2}')
        _insert(path, kind="redo", content='{"edit": 2}')
        own.append("walk", FLAG, "ben")
        own.append("walk", Undo(5), "ben")
        assert shared.take_over(own.history()) == 3
        assert shared.review("walk", FEET).flags[0].author == "anna"
        assert [type(edit.event) for edit in shared.history()] == [FlagRange, FlagRange, Undo]
        assert len(own.history()) == 5


def test_an_open_review_sees_a_bad_row_once_and_goes_on(log, write, monkeypatch):
    live = LiveReview(log, FEET)
    log.append("walk", FLAG, "anna")
    live.refresh()
    state = live.review("walk")
    bad = write()
    assert live.refresh() == live.revision == bad
    assert [row.number for row in live.unreadable("walk")] == [bad]
    assert live.unreadable("run") == ()
    assert live.review("walk") != state
    assert live.review("walk") == log.review("walk", FEET)
    asked = []
    reading = log.reading
    monkeypatch.setattr(log, "reading", lambda **how: asked.append(how) or reading(**how))
    live.refresh()
    assert asked == [{"after": bad}]
    assert len(live.unreadable()) == 1
    write(trial="run")
    live.refresh()
    assert sorted(live.reviews()) == ["run", "walk"]
    event = ClearRange(0, 3)
    number = live.record("walk", "ben", event, lambda: log.append("walk", event, "ben"))
    assert live.history("walk")[-1].number == number


def test_a_rescued_log_names_the_rows_that_it_does_not_have(path, tmp_path):
    with ReviewLog.open(path) as log:
        log.append("walk", FLAG, "anna")
        _insert(path, kind="merge", author="ben")
        _insert(path, kind="undo", content='{"edit": 2}')
        live = LiveReview(log, FEET)
        path.rename(tmp_path / "elsewhere")
        with pytest.raises(LostLogError, match="they cannot be read: row 2 by ben of walk"):
            live.refresh()
    (file,) = tmp_path.glob("*.rescued-*.sqlite")
    with ReviewLog.open(file) as found:
        assert [edit.event for edit in found.history()] == [FLAG]


def test_a_last_row_whose_date_is_no_text_is_not_taken_for_a_lost_file(path):
    with ReviewLog.open(path) as log:
        log.append("walk", FLAG, "anna")
        _insert(path, made_at="CAST(x'fffe' AS TEXT)")
    with ReviewLog.open(path) as log:
        live = LiveReview(log, FEET)
        number = live.record("walk", "ben", FLAG, lambda: log.append("walk", FLAG, "ben"))
        assert live.revision == number == 3
