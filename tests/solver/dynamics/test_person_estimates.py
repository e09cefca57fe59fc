from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Subject
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import MassEstimate, Standing
from solver.dynamics.person_estimates import (
    Plates,
    mass_of_height,
    person_height,
    person_mass,
    person_sex,
    probability_male,
)
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.scaling import scaled

HEIGHT = 1.60
NOBODY = Subject(folder=Path("nobody"), trials=())


@pytest.fixture(scope="module")
def body():
    return default_skeleton(height_m=HEIGHT)


def told(mass_kg, std_kg=1.3, lean_deg=0.0):
    return Plates(MassEstimate(mass_kg, std_kg, 0.5, lean_deg), read_something=True)


def test_an_entered_mass_stands_and_is_doubted_where_the_forces_differ(body):
    entered = replace(NOBODY, mass_kg=60.0)
    assert person_mass(entered, body, HEIGHT, told(60.5, 1.0), ComSettings()) == (60.0, (), None)
    mass = person_mass(entered, body, HEIGHT, told(90.0, 1.0), ComSettings())
    assert mass.kg == 60.0
    assert "entered" in mass.notes[0]
    weighed = replace(entered, mass_kg=63.0, scale_factor=63.0 / 60.0)
    assert "a scale says 63.0 kg" in person_mass(weighed, body, HEIGHT, told(63.0), ComSettings()).notes[0]


def test_forces_come_before_tables(body):
    mass = person_mass(NOBODY, body, HEIGHT, told(81.2), ComSettings())
    assert mass.kg == 81.2
    assert "81.2 ± 2.6 kg estimated from the forces" in mass.notes[0]
    assert mass.guessed_within is None


def test_who_stands_still_is_weighed_before_any_motion(body):
    standing = (Standing("static", MassEstimate(66.0, 1.0, 0.1)),)
    mass = person_mass(NOBODY, body, HEIGHT, replace(told(61.3), standing=standing), ComSettings())
    assert mass.kg == pytest.approx(66.0)
    assert "still on static" in mass.notes[0]
    assert mass.guessed_within is None


def test_a_weight_that_is_no_persons_of_that_height_is_none(body):
    """A plate that was tared under the person, or a chair and three people on it."""
    standing = (Standing("static", MassEstimate(20.0, 1.0, 0.1)),)
    mass = person_mass(NOBODY, body, HEIGHT, replace(told(61.3), standing=standing), ComSettings())
    assert mass.kg == 61.3


@pytest.mark.parametrize("read_something", [False, True])
def test_no_forces_is_said_only_where_there_are_none(body, read_something):
    mass = person_mass(NOBODY, body, HEIGHT, Plates(read_something=read_something), ComSettings())
    assert ("no forces to estimate it from" in mass.notes[0]) != read_something
    assert 0.1 < mass.guessed_within < 0.3


def test_forces_that_lean_are_told(body):
    notes = person_mass(NOBODY, body, HEIGHT, told(62.7, lean_deg=15.2), ComSettings()).notes
    assert any("lean 15° " in note and "slope" in note for note in notes)


@pytest.mark.parametrize(("mass_kg", "said"), [(205.0, True), (20.0, True), (45.0, False), (105.0, False)])
def test_forces_that_are_no_persons_of_that_height_are_told(body, mass_kg, said):
    """Plates that stand four times in a file, or in pounds."""
    mass = person_mass(NOBODY, body, HEIGHT, told(mass_kg), ComSettings())
    assert mass.kg == mass_kg
    assert any("people of 1.60 m weigh" in note for note in mass.notes) == said


def test_without_forces_the_height_tells_the_mass_and_how_surely(body):
    mass = person_mass(NOBODY, body, HEIGHT, Plates(), ComSettings())
    assert mass.kg == pytest.approx(mass_of_height(1.60, None)[0], rel=0.02)
    assert mass.kg != pytest.approx(body.mass, rel=0.05)  # the default body's own says nothing of the person
    assert f"{mass.kg:.0f} ± " in mass.notes[0]


def test_a_model_of_ones_own_keeps_its_mass(body):
    with_model = replace(NOBODY, model=Path("scaled.osim"))
    mass = person_mass(with_model, body, HEIGHT, Plates(), ComSettings())
    assert mass.kg == body.mass
    assert "the model's own" in mass.notes[0]


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


def test_without_a_leg_neither_height_nor_mass_is_synthetic(body):
    height, notes = person_height(NOBODY, body, legs_are_seen=False)
    assert np.isnan(height)
    assert "no leg is seen" in notes[0]
    mass = person_mass(NOBODY, body, height, Plates(), ComSettings())
    assert mass.guessed_within == np.inf
    assert "unknown" in mass.notes[0]


@pytest.mark.parametrize(("leg", "trunk"), [(1.16, 1.05), (0.9, 1.0), (1.0, 1.0)])
def test_legs_and_trunk_both_tell_the_height(body, leg, trunk):
    """Of long legs under a short trunk, the stature is neither's alone."""
    factors = np.ones((len(body.bodies), 3))
    for i, name in enumerate(body.body_names):
        factors[i] = leg if name.startswith(("femur", "tibia", "talus", "calcn")) else trunk
    height, _ = person_height(NOBODY, scaled(body, factors))
    assert height == pytest.approx(1.60 * (0.53 * leg + 0.47 * trunk), abs=0.01)


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
