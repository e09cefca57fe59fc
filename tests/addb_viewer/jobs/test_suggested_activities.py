"""The solver's words for what people do are words of the review log, all of them."""

import pytest

from addb_viewer.jobs.suggested_activities import as_suggested
from annotations.activities import ACTIVITIES
from solver.gait.activity import Activity, ActivitySuggestion, Kind

KINDS = {
    Activity.WALKING: (Kind.OVERGROUND, Kind.TREADMILL, Kind.INCLINE),
    Activity.RUNNING: (Kind.OVERGROUND, Kind.TREADMILL),
    Activity.STAIRS: (Kind.UP, Kind.DOWN),
    Activity.SIT_TO_STAND: (),
    Activity.JUMP: (Kind.PLAIN_JUMP, Kind.DROP_JUMP, Kind.SQUAT_JUMP, Kind.BOX_JUMP),
    Activity.SQUAT: (),
    Activity.LUNGE: (),
    Activity.STANDING: (Kind.BOTH_FEET, Kind.ONE_FOOT),
    Activity.TRANSITION: (Kind.START, Kind.END),
}


@pytest.mark.parametrize("activity", Activity)
def test_each_activity_and_kind_has_its_word(activity):
    told = {as_suggested(ActivitySuggestion(0, 9, activity, kind, 0.8)).subclass for kind in KINDS[activity]}
    word = as_suggested(ActivitySuggestion(0, 9, activity, None, 0.8)).activity
    assert told == set(ACTIVITIES[word])


def test_every_class_of_the_log_but_two_can_be_suggested():
    words = {as_suggested(ActivitySuggestion(0, 9, activity, None, 0.8)).activity for activity in Activity}
    assert words == set(ACTIVITIES) - {"other", "erroneous"}
