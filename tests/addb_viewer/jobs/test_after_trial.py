"""Whether a trial that was recorded to be sure made it sure."""

from dataclasses import replace

import pytest

from addb_viewer.jobs.diagnosing import after_trial
from solver.diagnosis.diagnosis import Remaining, ToBeSure
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport

ASKED = ToBeSure("plate_gain", "plate_2", "body_weight_support", "pelvis", 4.0, trial="stand")
BEFORE = DiagnosisReport("explained", (), (), {}, Remaining(9.0, 9.8), ("walk",), to_be_sure=ASKED)


def now(id="plate_gain", target="plate_2", confidence=0.97, verdict="explained"):
    causes = (Cause(id, target, {}, confidence, ()),) if id else ()
    return replace(BEFORE, verdict=verdict, effects=causes, trials=("stand", "walk"), to_be_sure=None)


@pytest.mark.parametrize(
    ("answer", "decided", "confidence"),
    [
        (now(), True, 0.97),
        (now(confidence=0.8), False, 0.8),
        (now("body_weight_support", "pelvis"), True, 0.0),
        (now("body_weight_support", "torso"), False, 0.0),
        (now("", verdict="clean"), False, 0.0),  # nothing was no rival
    ],
)
def test_it_decides_where_one_of_both_is_sure_now(answer, decided, confidence):
    found = after_trial(BEFORE, answer)
    assert (found.trials, found.decided, found.confidence) == (("stand",), decided, confidence)


def test_a_scale_decides_without_another_trial():
    weighed = replace(now(), trials=BEFORE.trials, scale_factor=1.04)
    assert after_trial(BEFORE, weighed).trials == ()
    assert after_trial(BEFORE, weighed).decided


def test_a_clean_answer_decides_for_nothing():
    against_nothing = replace(BEFORE, to_be_sure=replace(ASKED, other_id="nothing", other_target=""))
    assert after_trial(against_nothing, now("", verdict="clean")).decided


def test_it_is_said_as_long_as_no_other_trial_comes():
    found = after_trial(BEFORE, now())
    assert after_trial(replace(now(), after_trial=found), now()) is found


@pytest.mark.parametrize(
    "before", [None, replace(BEFORE, to_be_sure=None), replace(BEFORE, trials=("walk", "run"))]
)
def test_nothing_is_said_where_nothing_was_asked_or_a_trial_is_gone(before):
    assert after_trial(before, now()) is None
