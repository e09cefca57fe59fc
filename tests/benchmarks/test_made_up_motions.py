"""What is measured of a motion whose figures are known, and what is said of two groups of persons."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.activities.examples import Example
from benchmarks.made_up_motions import BESIDE, FEW, WITHIN, by_activity, figures, verdict
from solver.gait.activity import Activity
from solver.kinematics.motion import Motion
from solver.simulate.person import Person, body_of

RATE = 100.0


@pytest.fixture(scope="module")
def squat():
    body = body_of(Person(70.0, 1.75), np.random.default_rng(1)).skeleton
    wave = np.sin(2 * np.pi * np.arange(200) / 100)
    q = np.tile(body.default_q, (200, 1))
    for dof, size in {
        "hip_flexion_r": 0.4,
        "hip_flexion_l": 0.2,
        "knee_angle_r": 0.5,
        "knee_angle_l": 0.5,
    }.items():
        q[:, body.dofs.index(dof)] += size * wave
    q[:, body.dofs.index("pelvis_ty")] = 0.9 + 0.05 * wave
    load = np.where(np.arange(200) < 150, 1.2, np.nan)
    feet = ("calcn_r", "calcn_l")
    return Example("made", "p one", Activity.SQUAT, None, body, feet, Motion(body.dofs, q, RATE), load)


def test_ranges_and_loads_are_those_of_the_motion(squat):
    found = figures(squat)
    assert found["hip flexion, range [°]"] == pytest.approx(np.degrees(0.6))  # the middle of 0.8 and 0.4 rad
    assert found["knee flexion, range [°]"] == pytest.approx(np.degrees(1.0))
    assert found["ankle, range [°]"] == 0.0
    assert found["pelvis, rise and fall [cm]"] == pytest.approx(10.0)
    assert found["largest load [body weights]"] == pytest.approx(1.2)
    assert "cadence [1/min]" not in found


def test_a_person_counts_once(squat):
    values = by_activity([squat, squat, replace(squat, trial="other two")])
    assert {person: len(each) for person, each in values["squat", "ankle, range [°]"].items()} == {
        "p": 2,
        "other": 1,
    }


@pytest.mark.parametrize(
    ("recorded", "made_up", "said"),
    [
        ([1, 2, 3, 4, 5], [4.0, 4.5, 9.0], WITHIN),
        ([1, 2, 3, 4, 5], [5.0, 5.5, 5.2], BESIDE),
        ([1, 2, 3, 4], [2.0], FEW),
    ],
)
def test_the_middle_of_the_made_up_is_held_against_the_recorded(recorded, made_up, said):
    assert verdict(recorded, made_up) == said
