"""Causes that are there in one trial only."""

from dataclasses import replace

import pytest

from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.effect import all_and_each
from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport, Drag, ElasticTether
from solver.diagnosis.causes.plate_readings import ObjectOnPlate

CAUSES = [BodyWeightSupport, CarriedMass, Drag, ElasticTether, ObjectOnPlate]


@pytest.mark.parametrize("cause", CAUSES)
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
