"""Suggested activities wait for a person, and never touch what somebody has said."""

from datetime import UTC, datetime

import pytest

from annotations.events import ClearActivity, Edit, ImportTable, RefuseActivity, SetActivity, Undo
from annotations.folding import folded
from annotations.review_errors import ReviewError
from annotations.suggested_activity import SuggestedActivity, open_suggestions

FEET = ("calcn_r", "calcn_l")
WALK = SuggestedActivity(0, 400, "walk", "overground", 0.9, "rule")


def review(*events):
    return folded("t", [Edit(k + 1, "t", "anna", datetime.now(UTC), e) for k, e in enumerate(events)], FEET)


def places(*events, suggested=(WALK,)):
    return [(s.start, s.end, s.label) for s in open_suggestions(suggested, review(*events))]


def test_a_suggestion_waits_while_nobody_has_said_anything():
    assert places() == [(0, 400, "walk overground")]


def test_only_frames_without_a_label_are_suggested_whoever_said_it_and_whatever():
    assert places(SetActivity(100, 200, "run")) == [
        (0, 100, "walk overground"),
        (200, 400, "walk overground"),
    ]
    assert places(SetActivity(0, 400, "run", "treadmill")) == []
    table = ImportTable("a.csv", "ben", (), (SetActivity(0, 300, "squat"),))
    assert places(table) == [(300, 400, "walk overground")]


def test_a_label_that_was_taken_back_lets_the_suggestion_wait_again():
    assert places(SetActivity(0, 400, "run"), ClearActivity(0, 400)) == [(0, 400, "walk overground")]
    assert places(SetActivity(0, 400, "run"), Undo(1)) == [(0, 400, "walk overground")]


@pytest.mark.parametrize("refused", [(0, 400), (20, 380), (10, 600)])
def test_what_was_refused_is_not_suggested_again_a_few_frames_off(refused):
    assert places(RefuseActivity(*refused, "walk", "overground")) == []


def test_another_activity_and_another_place_are_suggested_after_a_refusal():
    assert places(RefuseActivity(0, 400, "walk", "treadmill")) == [(0, 400, "walk overground")]
    assert places(RefuseActivity(300, 700, "walk", "overground")) == [(0, 400, "walk overground")]


def test_a_refusal_can_be_taken_back():
    assert places(RefuseActivity(0, 400, "walk", "overground"), Undo(1)) == [(0, 400, "walk overground")]


def test_a_refusal_labels_nothing():
    assert review(RefuseActivity(0, 400, "walk", "overground")).activities == ()


def test_a_suggestion_names_an_activity_of_the_list():
    with pytest.raises(ReviewError, match="no activity 'wlak'; nearest: walk"):
        SuggestedActivity(0, 5, "wlak")
