"""Numbers of made-up motions, halved and doubled: how far people then are from recorded ones."""

import pytest

from benchmarks.activities.simulated import EVERYTHING, simulated
from benchmarks.made_up_motions import figures
from benchmarks.made_up_settings import NOT_ASKED, activities_of, distance, judged, page
from benchmarks.register import tuned_numbers
from benchmarks.varied import CHANCE, STANDS, Answer

REAL = (
    ("squat", "knee flexion, range [°]", {"one": 100.0, "other": 80.0}),
    ("squat", "largest load [body weights]", {"one": 1.2}),
    ("walking", "speed [m/s]", {"one": 1.3}),
)
MADE = {("squat", "knee flexion, range [°]"): 90.0, ("squat", "largest load [body weights]"): 1.08}
NAME = "simulate/posture.py SQUAT"


def test_angles_are_apart_in_tens_of_degrees_and_all_else_in_tenths():
    assert distance("knee flexion, range [°]", 75.0, 100.0) == pytest.approx(2.5)
    assert distance("largest load [body weights]", 1.5, 1.2) == pytest.approx(2.5)
    assert distance("stance [% of the stride]", 57.0, 60.0) == pytest.approx(0.5)


def test_each_recorded_person_counts_once_and_what_was_not_made_up_does_not():
    told = judged(NAME, 2.0, MADE, MADE, REAL)
    assert told.by_person == {"one": pytest.approx(0.5), "other": pytest.approx(0.5)}
    assert told.wrong == pytest.approx(1.0)
    assert (told.changed, told.of) == (0.0, 2)
    untold = judged(NAME, 2.0, {}, MADE, REAL)
    assert untold.wrong == pytest.approx(10.0)
    assert untold.changed == 1.0
    deeper = {**MADE, ("squat", "knee flexion, range [°]"): 100.0}
    other = judged(NAME, 2.0, deeper, MADE, REAL)
    assert other.by_person == {"one": pytest.approx(0.25), "other": pytest.approx(1.0)}
    assert other.changed == 0.5


def test_with_two_persons_nothing_is_better_beyond_chance():
    usual = Answer(NAME, 1.0, 1.0, 0.0, 2, {"one": 0.5, "other": 0.5})
    nearer = Answer(NAME, 2.0, 0.5, 0.5, 2, {"one": 0.3, "other": 0.2})
    farther = Answer(NAME, 0.5, 1.5, 1.0, 2, {"one": 0.8, "other": 0.7})
    told = page([farther, nearer], {NAME: usual})
    row = (
        "| `simulate/posture.py` | `SQUAT` | × 0.5: 1.50 for 1.00, 100 % change; × 2: 0.50 for 1.00, "
        "50 % change (better for 2 of 2 that differ, p 25.0 %) |"
    )
    assert row in told.split(f"## {CHANCE}: 1")[1]
    worse = Answer(NAME, 2.0, 1.2, 0.5, 2, {"one": 0.6, "other": 0.6})
    assert f"## {STANDS}: 1" in page([farther, worse], {NAME: usual})


def test_every_number_is_asked_about_what_it_has_a_part_in():
    names = [one.called for one in tuned_numbers(("simulate/",)) if one.name not in NOT_ASKED]
    asked = {name.split()[1]: activities_of(name) for name in names}
    assert asked["SQUAT"] == ("squat",)
    assert asked["STANDING"] == ("stand", "squat", "landing")
    assert asked["RUNNING_LEG"] == asked["RUNNING"] == ("run",)
    assert asked["HEEL_DOWN_S"] == ("landing",)
    assert not set(NOT_ASKED) & set(asked)
    assert set(activities_of("simulate/trial.py SPAN_S")) == EVERYTHING


def test_who_stands_is_told_by_how_the_arms_are_held(tmp_path):
    (example,) = simulated((0,), tmp_path, ("stand",))
    assert figures(example) == pytest.approx(
        {"arm held off [°]": -35, "elbow bent [°]": 8, "knee bent [°]": 3}, abs=3
    )
