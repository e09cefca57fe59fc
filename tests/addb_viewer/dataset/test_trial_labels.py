"""Who says what a person does: reviewers first, rules where they are silent, nobody elsewhere."""

from datetime import UTC, datetime

import pytest

from addb_viewer.dataset.grid import grid_of
from addb_viewer.dataset.trial_labels import TrialLabels
from annotations.events import Edit, RefuseActivity, SetActivity
from annotations.folding import folded
from annotations.suggested_activity import SuggestedActivity

FEET = ("calcn_r", "calcn_l")
WALK = SuggestedActivity(0, 60, "walk", "overground", 0.9, "rule")
STAIRS = SuggestedActivity(60, 100, "stairs", "up", 0.7, "rule (unlearnt)")


def labels(*events, suggested=(WALK, STAIRS)):
    made_at = datetime(2024, 1, 1, tzinfo=UTC)
    edits = [Edit(k, "t", "anna", made_at, event) for k, event in enumerate(events, start=1)]
    review = folded("t", tuple(edits), FEET)
    return TrialLabels(review, 100, {"anna": "reviewer_1"}).with_suggestions(suggested)


def whose(said):
    return said.of_frames(grid_of(100, 100.0, 0.0, 100.0))


def test_suggestions_hold_where_nobody_has_said_anything():
    said = labels()
    activity, sub, by = whose(said)
    assert activity == ["walk"] * 60 + ["stairs"] * 40
    assert (sub[0], sub[99]) == ("overground", "up")
    assert by == ["rule"] * 60 + ["rule (unlearnt)"] * 40
    assert (said.activity, said.by, said.confidence) == ("walk", "rule", pytest.approx(0.9))


def test_a_persons_word_stands_and_is_never_mixed_with_a_suggestion():
    said = labels(SetActivity(0, 50, "run", "overground"))
    activity, _, by = whose(said)
    assert activity == ["run"] * 50 + ["walk"] * 10 + ["stairs"] * 40
    assert by[:51] == ["person"] * 50 + ["rule"]
    assert (said.activity, said.by, said.confidence) == ("run", "person", None)
    same = labels(SetActivity(0, 40, "walk", "overground"), SetActivity(60, 100, "squat"))
    assert [(one.start, one.end, one.by) for one in same.stretches] == [
        (0, 40, "person"),
        (40, 60, "rule"),
        (60, 100, "person"),
    ]


def test_what_somebody_refused_is_not_said():
    said = labels(RefuseActivity(0, 60, "walk", "overground"))
    assert whose(said)[0] == ["none"] * 60 + ["stairs"] * 40
    assert whose(said)[2][0] == "nobody"
    assert (said.activity, said.by) == ("stairs", "rule (unlearnt)")


def test_an_erroneous_stretch_is_no_trials_label():
    said = labels(SetActivity(0, 90, "erroneous"), suggested=())
    assert (said.activity, said.by, said.confidence) == ("none", "nobody", None)


def test_certainty_is_that_of_the_mean_frame():
    again = SuggestedActivity(60, 90, "walk", "overground", 0.6, "rule")
    assert labels(suggested=(WALK, again)).confidence == pytest.approx((60 * 0.9 + 30 * 0.6) / 90)
