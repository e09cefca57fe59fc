"""Suggested activities, by other numbers: who teaches about whom, and what a silence costs."""

import numpy as np

from benchmarks import activity_settings
from benchmarks.activities.examples import Example
from benchmarks.activities.judging import NOTHING, Answer
from benchmarks.activities.looking import Look
from benchmarks.activity_settings import SIMULATED, Known, group_of, teaches
from solver.gait.activity import Activity, ActivitySuggestion, Kind
from solver.gait.activity_settings import ACTIVITIES


def look(source, trial, activity=Activity.WALKING, kind=Kind.TREADMILL):
    example = Example(source, trial, activity, kind, None, (), None)
    return Look(example, None, np.empty((0, 0)))


def test_nobody_teaches_about_themselves_nor_a_laboratory_about_its_recordings():
    one, same, other = (
        look(SIMULATED, f"person {who}") for who in ("3, run", "3, slow walk, belt", "101, run")
    )
    lab, its, elsewhere = look("A", "a/one walk"), look("A", "a/two squats"), look("B", "b walk")
    assert [teaches(them, group_of(one)) for them in (one, same, other, lab)] == [False, False, True, False]
    assert [teaches(them, group_of(lab)) for them in (its, elsewhere, one)] == [False, True, True]


def test_a_wrong_suggestion_is_wrong_twice_and_none_once(monkeypatch):
    def suggestion(activity, kind):
        return ActivitySuggestion(0, 10, activity, kind, 0.9, "rule")

    trial = look("A", "a walk")
    said = [
        suggestion(Activity.WALKING, Kind.TREADMILL),
        None,
        suggestion(Activity.WALKING, Kind.OVERGROUND),
        suggestion(Activity.SQUAT, None),
    ]
    monkeypatch.setattr(activity_settings, "answers", lambda *_: [Answer(trial, one) for one in said])
    known = Known(trial, "walk", lambda _: None)
    told = known.answers(ACTIVITIES)
    assert known.person == "a"
    assert told[:4] == ["walking, treadmill", False, NOTHING, False]
    wrong = [one != right for one, right in zip(told, known.truth, strict=True)]
    assert wrong == [False, False, True, False, True, True, True, True]


def test_a_sub_label_that_nobody_knows_is_not_asked_for(monkeypatch):
    trial = look("A", "a walk", kind=None)
    said = ActivitySuggestion(0, 10, Activity.WALKING, Kind.OVERGROUND, 0.9, "rule")
    monkeypatch.setattr(activity_settings, "answers", lambda *_: [Answer(trial, said)])
    known = Known(trial, "walk", lambda _: None)
    assert known.answers(ACTIVITIES) == known.truth == ["walking", False]
