from dataclasses import replace
from pathlib import Path

import pytest

from solver.capture.capture import Subject
from solver.dynamics.com_mass import MassEstimate
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.person_estimates import (
    mass_of_height,
    person_height,
    person_mass,
    person_sex,
    probability_male,
)
from solver.skeleton.default_body import default_skeleton

NOBODY = Subject(folder=Path("nobody"), trials=())


@pytest.fixture(scope="module")
def body():
    return default_skeleton(height_m=1.60)


def test_an_entered_mass_stands_and_is_doubted_where_the_forces_differ(body):
    entered = replace(NOBODY, mass_kg=60.0)
    assert person_mass(entered, body, MassEstimate(60.5, 1.0, 0.5), ComSettings()) == (60.0, ())
    mass, notes = person_mass(entered, body, MassEstimate(90.0, 1.0, 0.5), ComSettings())
    assert mass == 60.0
    assert "entered" in notes[0]


def test_forces_come_before_tables(body):
    mass, notes = person_mass(NOBODY, body, MassEstimate(81.2, 1.3, 0.5), ComSettings())
    assert mass == 81.2
    assert "81.2 ± 1.3 kg estimated from the forces" in notes[0]


@pytest.mark.parametrize(("mass_kg", "told"), [(205.0, True), (20.0, True), (45.0, False), (105.0, False)])
def test_forces_that_are_no_persons_of_that_height_are_told(body, mass_kg, told):
    """Plates that stand four times in a file, or in pounds."""
    mass, notes = person_mass(NOBODY, body, MassEstimate(mass_kg, 1.3, 0.5), ComSettings())
    assert mass == mass_kg
    assert any("people of 1.60 m weigh" in note for note in notes) == told


def test_without_forces_the_height_tells_the_mass_and_how_surely(body):
    mass, notes = person_mass(NOBODY, body, None, ComSettings())
    assert mass == pytest.approx(mass_of_height(1.60, None)[0], rel=0.02)
    assert mass != pytest.approx(body.mass, rel=0.05)  # the default body's own says nothing of the person
    assert f"{mass:.0f} ± " in notes[0]


def test_a_model_of_ones_own_keeps_its_mass(body):
    with_model = replace(NOBODY, model=Path("scaled.osim"))
    mass, notes = person_mass(with_model, body, None, ComSettings())
    assert mass == body.mass
    assert "the model's own" in notes[0]


@pytest.mark.parametrize(
    ("height", "sex", "mass"),
    [  # CDC 2000, medians at 6 and 10 years; NHANES 2015-2018 weighs grown-ups more than soldiers
        (1.15, None, 20.5),
        (1.385, None, 32.5),
        (1.756, "male", 78.5),
        (1.629, "female", 62.0),
    ],
)
def test_masses_of_the_tables_lie_within_the_stated_spread(height, sex, mass):
    told, std = mass_of_height(height, sex)
    assert abs(told - mass) < std
    assert 0.1 < std / told < 0.25


def test_the_height_of_the_body_is_told_with_its_uncertainty(body):
    height, notes = person_height(NOBODY, body)
    assert height == pytest.approx(1.60, abs=0.01)
    assert "±" in notes[0]
    assert person_height(replace(NOBODY, height_m=1.9), body) == (1.9, ())


def test_the_sex_is_called_likely_only_where_it_is(body):
    assert "; male with a probability" in person_sex(NOBODY, 1.95)[0]
    assert "; female with a probability" in person_sex(NOBODY, 1.50)[0]
    assert "does not show it" in person_sex(NOBODY, 1.70)[0]
    assert "child" in person_sex(NOBODY, 1.20)[0]
    assert person_sex(replace(NOBODY, sex="female"), 1.95) == ()
    assert person_sex(replace(NOBODY, model=Path("own.osim")), 1.95) == ()


def test_an_uncertain_height_says_less():
    assert 0.5 < probability_male(1.85, 0.05) < probability_male(1.85, 0.0)
    assert 0.5 > probability_male(1.55, 0.05) > probability_male(1.55, 0.0)
