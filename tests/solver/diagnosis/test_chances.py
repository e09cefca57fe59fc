"""How likely nothing is wrong where nothing is named."""

import pytest

from solver.diagnosis.chances import compare_chances
from solver.diagnosis.checks import DECIDED, PAYS, POSSIBLE, Decision
from solver.diagnosis.decisions import CauseDecisions
from solver.diagnosis.search.contenders import TEMPER_NATS
from solver.fitting.diagnosis_settings import DiagnosisSettings

SETTINGS = DiagnosisSettings()
NONE = float("-inf")


def refused(odds, check=PAYS, limit=8.0):
    return CauseDecisions("drag", "torso", False, odds, (Decision(check, False, odds, limit, ""),))


def test_with_nothing_tried_nothing_is_wrong():
    told = compare_chances([], NONE, SETTINGS)
    assert (told.nothing, told.on_the_list, told.something_else) == (1.0, 0.0, 0.0)


def test_a_cause_that_gains_just_what_is_asked_is_as_likely_as_nothing():
    told = compare_chances([refused(SETTINGS.least_gain), refused(1.0)], NONE, SETTINGS)
    assert told.nothing == pytest.approx(told.on_the_list) == pytest.approx(0.5)


def test_each_temper_less_is_e_times_less_likely():
    told = compare_chances([refused(SETTINGS.least_gain - TEMPER_NATS, DECIDED)], NONE, SETTINGS)
    assert told.nothing / told.on_the_list == pytest.approx(2.718, abs=0.001)


def test_of_two_causes_together_more_is_asked():
    told = compare_chances([refused(18.0, limit=18.0)], NONE, SETTINGS)
    assert told.nothing == pytest.approx(told.on_the_list)
    assert compare_chances([refused(12.0, limit=18.0)], NONE, SETTINGS).nothing > 0.8


def test_what_cannot_be_counts_for_nothing_however_much_it_gains():
    assert compare_chances([refused(300.0, POSSIBLE)], NONE, SETTINGS).nothing == 1.0


def test_a_large_unknown_is_something_else():
    told = compare_chances([refused(4.0)], 90.0, SETTINGS)
    assert told.something_else > 0.99
    assert told.nothing + told.on_the_list + told.something_else == pytest.approx(1.0)
