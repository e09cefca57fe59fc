"""What nothing being wrong is worth: sizes that would have been found, and the chances of what else."""

from dataclasses import replace

import pytest

from solver.diagnosis.cause_decisions import CauseDecisions, compare_chances
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.checks import DECIDED, PAYS, POSSIBLE, Decision
from solver.diagnosis.diagnose_subject import find_detectable
from solver.diagnosis.search.contenders import TEMPER_NATS
from solver.diagnosis.search.selection import select
from solver.fitting.diagnosis_settings import DiagnosisSettings

DRAWS = 12


@pytest.fixture(scope="module")
def limit(drawn, balance_of_scenes):
    """Of a plate's gain, as a sound recording tells it."""
    balance = balance_of_scenes(drawn(1))
    (gain,) = find_detectable(balance, balance.solve([]), [PlateGain("plate_1")])
    return gain


def found(short_scene, drawn, balance_of_scenes, gain_error):
    """How often a plate that reads so much too much is named."""
    plate = short_scene.plates[0].wrench_ground
    times = 0
    for seed in range(10, 10 + DRAWS):
        balance = balance_of_scenes(drawn(seed, -gain_error / (1 + gain_error) * plate))
        times += bool(select(balance, [PlateGain("plate_1")]).found)
    return times


def test_a_cause_is_found_from_that_size_on(short_scene, drawn, balance_of_scenes, limit):
    assert limit.parameter == "gain_error"
    assert found(short_scene, drawn, balance_of_scenes, limit.size) >= 0.75 * DRAWS


def test_a_third_of_it_is_hardly_ever_found(short_scene, drawn, balance_of_scenes, limit):
    assert found(short_scene, drawn, balance_of_scenes, limit.size / 3) <= 0.25 * DRAWS


def test_nothing_is_found_that_nobody_would_act_on(drawn, balance_of_scenes, limit):
    """With no noise to speak of, the size to act on is what counts."""
    balance = balance_of_scenes(drawn(1))
    quiet = replace(balance.trials[0], covariance=1e-4 * balance.trials[0].covariance)
    sharp = type(balance)(
        [replace(quiet, nuisance=0.01 * quiet.nuisance, tissue=0.01 * quiet.tissue)], balance.settings
    )
    clock = find_detectable(sharp, sharp.solve([]), [ClockOffset("all")])[0]
    assert clock.size > 0.002
    blunt = find_detectable(balance, balance.solve([]), [ClockOffset("all")])[0]
    assert blunt.size > clock.size


def test_each_direction_of_each_plate_is_told(drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(1))
    asked = [PlatePosition("plate_1"), PlatePosition("plate_2")]
    sizes = find_detectable(balance, balance.solve([]), asked)
    assert [(s.target, s.parameter) for s in sizes] == [
        ("plate_1", "shift_x_m"),
        ("plate_1", "shift_z_m"),
        ("plate_2", "shift_x_m"),
        ("plate_2", "shift_z_m"),
    ]


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
