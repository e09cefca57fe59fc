"""From which size on a cause is found: told in advance, and found."""

from dataclasses import replace

import pytest

from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.detectable import find_detectable
from solver.diagnosis.search.selection import select

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
