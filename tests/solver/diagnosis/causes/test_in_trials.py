"""Causes that are there in one trial only."""

from dataclasses import replace

import pytest

from solver.diagnosis.causes import body_weight_support, carried_mass, drag, elastic_tether, object_on_plate
from solver.diagnosis.causes.effect import all_and_each

MODULES = [body_weight_support, carried_mass, drag, elastic_tether, object_on_plate]


@pytest.mark.parametrize("module", MODULES)
def test_each_trial_alone_and_all_of_them(scene, module):
    other = replace(scene, name="other")
    found = module.candidates([scene, other])
    assert {c.trial for c in found} == {None, scene.name, "other"}
    assert {c.trial for c in module.candidates([scene])} == {None}
    by_trial = {c.trial: c for c in found if c.target == found[0].target}
    eta = by_trial["other"].starts([scene, other])[0]
    assert by_trial["other"].signature(scene, eta) is None
    assert by_trial["other"].signature(other, eta) is not None
    assert by_trial[None].signature(scene, eta) is not None
    ranges = by_trial["other"].frames([scene, other], eta, None)
    assert [(r.trial, r.start, r.end) for r in ranges] == [("other", 0, scene.frames)]


def test_one_trial_is_not_tried_twice(scene):
    assert all_and_each([scene]) == [None]
