"""What causes have in common: how parameters are told, a practical minimum, where candidates are made."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.clocks import ClockOffset, PlateClock, SampleRate
from solver.diagnosis.causes.effect import Fitted, all_and_each
from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport, Drag, ElasticTether
from solver.diagnosis.causes.plate_geometry import GravityTilt, PlatePosition, PlateYaw
from solver.diagnosis.causes.plate_readings import ObjectOnPlate, PlateBias, PlateGain

SEARCHED = [
    (ClockOffset("all"), "offset_s", 0.008, 0.001),
    (PlateClock("plate_1"), "offset_s", 0.02, -0.003),
    (SampleRate("all"), "stretch", -0.01, 0.001),
]
LINEAR = [
    (PlateGain("plate_1"), {"gain_error": -0.04}, 0.25),
    (PlateBias("plate_1"), {"bias_x_N": 6.0, "bias_y_N": -12.0, "bias_z_N": 7.0}, 0.2),
    (PlatePosition("plate_1"), {"shift_x_m": 0.012, "shift_z_m": -0.004}, 0.3),
]


@pytest.mark.parametrize(("cause", "name", "large", "small"), SEARCHED, ids=[c[0].id for c in SEARCHED])
def test_what_is_searched_is_told_with_its_spread_and_only_large_is_notable(cause, name, large, small):
    def told(value):
        return cause.estimates([], Fitted((value,), (0.001,), np.zeros(0), np.zeros((0, 0))))

    assert {n: (e.value, e.std) for n, e in told(large).items()} == {name: (large, 0.001)}
    assert cause.is_notable(told(large))
    assert not cause.is_notable(told(small))
    assert not cause.admissible((0.5,))


@pytest.mark.parametrize(("cause", "large", "share"), LINEAR, ids=[c[0].id for c in LINEAR])
def test_what_acts_linearly_is_told_with_its_spread_and_only_large_is_notable(cause, large, share):
    values, std = np.array([*large.values()]), 0.1 * np.arange(1.0, 1 + len(large))

    def told(x):
        return cause.estimates([], Fitted((), (), x, np.diag(std**2)))

    assert {name: e.value for name, e in told(values).items()} == large
    assert [e.std for e in told(values).values()] == pytest.approx(std)
    assert cause.is_notable(told(values))
    assert not cause.is_notable(told(share * values))


@pytest.mark.parametrize("cause", [PlateGain, PlateYaw, PlatePosition])
def test_every_loaded_plate_is_a_candidate_and_no_other_is_touched(crisp, seen, cause):
    scene = seen(crisp)
    made = cause.candidates([scene, scene])
    assert list(dict.fromkeys(c.target for c in made)) == [p.target for p in scene.plates]
    assert made[0].signature(replace(scene, plates=scene.plates[1:]), ()) is None


@pytest.mark.parametrize("cause", [ClockOffset, SampleRate, GravityTilt])
def test_what_all_plates_have_is_one_candidate_where_anything_is_loaded(crisp, seen, cause):
    scene = seen(crisp)
    assert [c.target for c in cause.candidates([scene])] == ["all"]
    assert cause.candidates([replace(scene, plates=())]) == []


@pytest.mark.parametrize("cause", [BodyWeightSupport, ElasticTether, Drag])
def test_belts_and_harnesses_hold_pelvis_and_trunk(scene, cause):
    assert [c.target for c in cause.candidates([scene])] == ["pelvis", "torso"]


@pytest.mark.parametrize("cause", [BodyWeightSupport, CarriedMass, Drag, ElasticTether, ObjectOnPlate])
def test_each_trial_alone_and_all_of_them(scene, cause):
    other = replace(scene, name="other")
    found = cause.candidates([scene, other])
    assert {c.trial for c in found} == {None, scene.name, "other"}
    assert {c.trial for c in cause.candidates([scene])} == {None}
    by_trial = {c.trial: c for c in found if c.target == found[0].target}
    eta = by_trial["other"].starts([scene, other])[0]
    assert by_trial["other"].signature(scene, eta) is None
    assert by_trial["other"].signature(other, eta) is not None
    assert by_trial[None].signature(scene, eta) is not None
    ranges = by_trial["other"].frames([scene, other], eta, None)
    assert [(r.trial, r.start, r.end) for r in ranges] == [("other", 0, scene.frames)]


def test_one_trial_is_not_tried_twice(scene):
    assert all_and_each([scene]) == [None]
