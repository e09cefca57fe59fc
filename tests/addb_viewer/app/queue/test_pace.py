"""Who has done how much, how fast, and how far two reviewers agree."""

from dataclasses import replace

import pytest

from addb_viewer.app.queue.pace import Share, hours_left, pairs, shares
from addb_viewer.app.queue.queue_rows import Mark, Row
from addb_viewer.jobs.review_store import open_log
from annotations.events import ClearRange, FlagRange, Status
from solver.capture.capture import Subject, TrialFiles
from tests.addb_viewer.fit_figures import of_trial

FIRST = 1_700_000_000.0


def row(trial, *marks, finished_by=None, **more):
    status = Status.IN_WORK if finished_by is None else Status.FINISHED
    return Row("S1", trial, status, finished_by, of_trial(), marks=tuple(marks), **more)


def test_time_at_work_leaves_out_pauses_and_is_counted_over_all_trials():
    rows = [
        row("a", Mark("anna", FIRST, False), Mark("anna", FIRST + 300, True), finished_by="anna"),
        row("b", Mark("anna", FIRST + 900, True), finished_by="anna"),
        row("c", Mark("anna", FIRST + 90_000, False), assigned_to="ben"),
        row("d"),
    ]
    anna, ben = shares(rows)
    assert anna == Share("anna", 2, 4, 900 / 3600, FIRST + 90_000, 0)
    assert anna.an_hour == pytest.approx(8.0)  # two in a quarter of an hour
    assert (ben.name, ben.assigned, ben.an_hour) == ("ben", 1, None)
    assert hours_left(rows) == pytest.approx(0.25)  # two are left, and two took a quarter of an hour


def test_a_pace_of_a_minute_is_none():
    rows = [
        row("a", Mark("anna", FIRST, False), Mark("anna", FIRST + 60, True), finished_by="anna"),
        row("b"),
    ]
    assert shares(rows)[0].an_hour is None
    assert hours_left(rows) is None


def test_agreement_is_that_of_all_trials_that_both_have_judged(tmp_path):
    """By hand, for one foot of two: 400 labels, 60 missing for both, 20 for one alone, 20 for the other."""
    marks = (Mark("anna", FIRST, False), Mark("ben", FIRST, False))
    with open_log(tmp_path) as log:
        for trial, anna, ben in (("a", (0, 40), (20, 60)), ("b", (10, 50), (10, 50))):
            log.append(trial, FlagRange(*anna, "manualReview", "calcn_r"), "anna")
            log.append(trial, FlagRange(*ben, "manualReview", "calcn_r"), "ben")
        log.append("c", ClearRange(0, 10), "anna")
    rows = [row("a", *marks), row("b", *marks), row("c", marks[0]), replace(row("d", *marks), figures=None)]
    files = tuple(TrialFiles(name, tmp_path / f"{name}.trc") for name in "abcd")
    (pair,) = pairs(rows, {"S1": Subject(tmp_path, files, foot_bodies=("calcn_r", "calcn_l"))})
    assert (pair.one, pair.other, pair.trials) == ("anna", "ben", 2)
    assert pair.same == pytest.approx(360 / 400)
    by_chance = (80 * 80 + 320 * 320) / 400**2
    assert pair.kappa == pytest.approx((0.9 - by_chance) / (1 - by_chance))


@pytest.mark.parametrize(
    ("marks", "assigned", "left_to"),
    [
        ((), "", ""),
        ((), "anna", ""),
        ((), "ben", "ben"),
        ((Mark("ben", FIRST - 60, False),), "", "ben"),  # in another app
        ((Mark("ben", FIRST - 60, False),), "anna", ""),
        ((Mark("ben", FIRST - 3600, False),), "", ""),
        ((Mark("chen", FIRST - 60, False),), "", ""),  # at a page of this one: it is known where
        ((Mark("ben", FIRST - 60, False), Mark("anna", FIRST - 30, False)), "", ""),
    ],
)
def test_whose_a_trial_is(marks, assigned, left_to):
    assert row("a", *marks, assigned_to=assigned).left_to("anna", {"chen"}, FIRST) == left_to
