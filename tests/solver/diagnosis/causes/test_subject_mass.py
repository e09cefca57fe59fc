from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import SubjectMass
from solver.diagnosis.causes.effect import Fitted
from solver.simulate.other_masses import with_segment_masses


def test_is_the_force_that_a_heavier_person_demands_more(scene, demand_of):
    heavier = with_segment_masses(scene.skeleton, dict.fromkeys(scene.skeleton.body_names, 1.07))
    missing = demand_of(scene.skeleton) - demand_of(heavier)
    said = 0.07 * SubjectMass("all").signature(scene, ()).columns[:, :, 0]
    np.testing.assert_allclose(said[:, :3], missing[:, :3], atol=1e-5 * np.abs(missing[:, :3]).max())


def test_claims_nothing_of_the_body_s_spin(scene):
    said = SubjectMass("all").signature(scene, ()).columns[:, :, 0]
    np.testing.assert_allclose(said[:, 3:], np.cross(scene.com_ground, said[:, :3]), atol=1e-9)


def test_the_factor_is_true_over_entered():
    candidate = SubjectMass("all")
    found = candidate.estimates([], Fitted((), (), np.array([-0.03]), np.array([[0.004**2]])))
    assert found["mass_factor"].value == pytest.approx(0.97)
    assert found["mass_factor"].std == pytest.approx(0.004)
    assert candidate.is_notable(found)
    assert not candidate.is_notable({"mass_factor": replace(found["mass_factor"], value=1.01)})


@pytest.mark.parametrize(
    ("true_kg", "entered_kg", "can_be"), [(62.6, 78.2, True), (70, 55, True), (80, 50, False)]
)
def test_the_mass_of_another_adult_may_have_been_entered(true_kg, entered_kg, can_be):
    """Half as much again is no wrong entry, but forces that are missing or in other units."""
    candidate = SubjectMass("all")
    found = candidate.estimates(
        [], Fitted((), (), np.array([true_kg / entered_kg - 1]), np.array([[0.01**2]]))
    )
    assert candidate.is_notable(found) == can_be


def test_there_is_one_person(scene):
    assert [c.target for c in SubjectMass.candidates([scene, scene])] == ["all"]


def test_what_nobody_entered_cannot_be_wrong(scene):
    assert SubjectMass.candidates([replace(scene, weighed=False)]) == []
