"""Labels out as a table and in again."""

import csv
import io
import re
from datetime import UTC, datetime

import pytest

from annotations.events import (
    AcceptProposal,
    ClearRange,
    Edit,
    FlagRange,
    ImportTable,
    Proposal,
    SetActivity,
    SetStatus,
    Status,
)
from annotations.folding import folded
from annotations.ranges_csv import COLUMNS, TAKEN, ranges_csv, tables_from_csv
from annotations.review_errors import ReviewError

FEET = ("calcn_r", "calcn_l")
FRAMES = {"walk, slow": 40, "run": 40}
HEAD = ",".join(COLUMNS) + "\n"


@pytest.fixture
def reviews(log):
    log.append("walk, slow", FlagRange(5, 9, "notOverForcePlate", "calcn_r", 'said "edge",\ntwice'), "anna")
    log.append("walk, slow", ClearRange(7, 8, note="but here"), "anna")
    log.append("walk, slow", SetActivity(0, 40, "walk", "treadmill", "1.2 m/s"), "ben")
    log.append("walk, slow", SetActivity(30, 40, "transition"), "ben")
    log.append("walk, slow", SetStatus(Status.SECOND_LOOK, "plate 2?"), "ben")
    log.append("run", AcceptProposal(Proposal(0, 2, "missingBlip", None, 0.875, {}, "detector 1")), "ben")
    return [log.review(trial, FEET) for trial in log.trials()]


def taken(text):
    return tables_from_csv(text, "labels.csv", "cleo", FRAMES, FEET)


def test_every_label_is_a_line_that_a_csv_reader_understands(reviews):
    rows = list(csv.DictReader(io.StringIO(ranges_csv(reviews))))
    said = [{name: cell for name, cell in row.items() if cell} for row in rows]
    run, walk = {"trial": "run"}, {"trial": "walk, slow"}
    right = {
        "foot": "calcn_r",
        "reason": "notOverForcePlate",
        "source": "person",
        "note": 'said "edge",\ntwice',
    }
    assert said == [
        run
        | {"start": "0", "end": "2", "reason": "missingBlip", "source": "accepted proposal", "author": "ben"}
        | {"edit": "6", "confidence": "0.875", "detector": "detector 1"},
        run | {"status": "in work", "author": "ben"},
        walk
        | {"start": "0", "end": "30", "activity": "walk", "subclass": "treadmill", "note": "1.2 m/s"}
        | {"author": "ben", "edit": "3"},
        walk | {"start": "5", "end": "7", "author": "anna", "edit": "1"} | right,
        walk
        | {"start": "7", "end": "8", "reason": "notMissingGRF", "source": "person", "author": "anna"}
        | {"edit": "2", "note": "but here"},
        walk | {"start": "8", "end": "9", "author": "anna", "edit": "1"} | right,
        walk | {"start": "30", "end": "40", "activity": "transition", "author": "ben", "edit": "4"},
        walk | {"status": "needs a second look", "author": "ben", "note": "plate 2?"},
    ]


def test_nothing_said_is_the_head_alone(log):
    assert ranges_csv([log.review("walk", FEET)]) == HEAD


def test_a_table_comes_in_as_it_went_out_but_for_who_said_it(reviews):
    tables, ignored = taken(ranges_csv(reviews))
    assert ignored == ("source", "author", "edit", "confidence", "detector")
    for review in reviews:
        again = folded_table(review.trial, tables[review.trial])
        assert shown(again) == shown(review)
        assert {label.source for label in (*again.flags, *again.cleared)} == {"imported"}


@pytest.mark.parametrize(
    "text",
    [
        "trial,start,end,reason\nrun,3,5,notOverForcePlate\n",
        "trial;start;end;reason\r\nrun;3;5;not over a plate\r\n",
        "end,start,trial,reason,foot\n5,3,run,1,\n",
    ],
)
def test_a_table_of_ones_own_needs_few_columns(text):
    tables, ignored = taken(text)
    assert tables == {"run": ImportTable("labels.csv", "cleo", (FlagRange(3, 5, "notOverForcePlate"),))}
    assert ignored == ()


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("jump,3,5,,missingBlip,,", "line 2: no trial 'jump'; the subject has walk, slow, run"),
        ("run,3,5,,,,", "line 2: give one of reason, activity, status in a row, not 0"),
        ("run,3,5,,missingBlip,walk,", "line 2: give one of reason, activity, status in a row, not 2"),
        ("run,3,41,,missingBlip,,", "line 2: 3:41 is not within the trial, which is 0:40"),
        ("run,5,5,,missingBlip,,", "line 2: no frames in 5:5"),
        ("run,x,5,,missingBlip,,", "line 2: 'x' is not a frame number; 'start' needs one"),
        ("run,,5,,missingBlip,,", "line 2: '' is not a frame number; 'start' needs one"),
        ("run,3,5,toes,missingBlip,,", "line 2: no foot 'toes'; the subject has calcn_r, calcn_l"),
        ("run,3,5,,missingBlop,,", "line 2: no reason 'missingBlop'; nearest: missingBlip"),
        ("run,3,5,,,walking,", "line 2: no activity 'walking'; nearest: walk"),
        ("run,,,,,,done", "line 2: no status 'done'; there are unseen, in work"),
        ("run,3,5,,missingBlip,,,too", "line 2: more cells than the header has columns"),
        ('run,3,5,,"missing', "after line 1: not CSV"),
    ],
)
def test_a_row_that_cannot_be_taken_is_named_by_its_line(row, said):
    with pytest.raises(ReviewError, match=f"labels.csv, {re.escape(said)}"):
        taken(f"trial,start,end,foot,reason,activity,status\n{row}\n")


@pytest.mark.parametrize("text", ["", "start,end,reason\n1,2,missingBlip\n", "trial,start,end\nrun,1,2\n"])
def test_a_table_without_the_columns_that_matter_is_refused(text):
    with pytest.raises(ReviewError, match=r"labels\.csv: needs a header row with 'trial' and one of"):
        taken(text)


def folded_table(trial, table):
    return folded(trial, [Edit(1, trial, "imported", datetime.now(UTC), table)], FEET)


def shown(review):
    """The columns of the table that are taken in."""
    return [{name: row[name] for name in TAKEN} for row in csv.DictReader(io.StringIO(ranges_csv([review])))]
