"""Angles by landmarks, on a person laid out by hand: x forwards, y up, z to the right."""

import numpy as np
import pytest

from benchmarks.anatomical_angles import anatomical_angles
from solver.skeleton.rotations import rotation_about

HEADINGS = np.radians([0.0, 50.0, 170.0])


def person(hip_deg=0.0, knee_deg=0.0, ankle_deg=0.0, pelvis_deg=0.0):
    """Landmarks and the right leg's centres in three headings; angles are flexions, the pelvis' a tilt."""
    tilt = rotation_about(np.array([0.0, 0.0, 1.0]), np.radians([-pelvis_deg]))[0]
    spines = {
        "asis_r": (0.0, 0.0, 0.12),
        "asis_l": (0.0, 0.0, -0.12),
        "psis_r": (-0.15, 0.0, 0.04),
        "psis_l": (-0.15, 0.0, -0.04),
    }
    marks = {name: tilt @ np.array(place) for name, place in spines.items()}
    hip = tilt @ np.array([-0.06, -0.08, 0.08])
    thigh, shank, foot = np.radians(np.cumsum([hip_deg - pelvis_deg, -knee_deg, 90 + ankle_deg]))
    knee = hip + 0.4 * np.array([np.sin(thigh), -np.cos(thigh), 0])
    ankle = knee + 0.4 * np.array([np.sin(shank), -np.cos(shank), 0])
    marks["heel_r"] = ankle + np.array([-0.05, -0.05, 0])
    along = 0.17 * np.array([np.sin(foot), -np.cos(foot), 0])
    marks |= {"mt1_head_r": marks["heel_r"] + along, "mt5_head_r": marks["heel_r"] + along + [0, 0, 0.05]}
    turn = rotation_about(np.array([0.0, 1.0, 0.0]), HEADINGS)

    def turned(points):
        return {name: np.einsum("tij,j->ti", turn, place) for name, place in points.items()}

    return turned(marks), turned({"hip": hip, "knee": knee, "ankle": ankle})


@pytest.mark.parametrize("pelvis_deg", [0.0, 15.0])
@pytest.mark.parametrize("joint", ["hip", "knee", "ankle"])
def test_a_joint_turned_by_so_much(joint, pelvis_deg):
    rest = anatomical_angles(*person(pelvis_deg=pelvis_deg), "r")
    bent = anatomical_angles(*person(pelvis_deg=pelvis_deg, **{f"{joint}_deg": 25.0}), "r")
    sign = -1 if joint == "knee" else 1
    for name in ("hip", "knee", "ankle"):
        turned = np.degrees(bent[name] - rest[name])
        np.testing.assert_allclose(turned, sign * 25.0 * (name == joint), atol=0.7)


def test_the_hip_is_that_of_the_spines_line():
    """A pelvis tipped forwards under a thigh that stays bends the hip."""
    upright, tipped = person(), person(pelvis_deg=10.0, hip_deg=10.0)
    turned = anatomical_angles(*tipped, "r")["hip"] - anatomical_angles(*upright, "r")["hip"]
    np.testing.assert_allclose(np.degrees(turned), 10.0, atol=1e-9)


def test_a_sacrum_stands_for_the_posterior_spines():
    marks, centres = person()
    sacrum = {**marks, "sacrum": (marks["psis_r"] + marks["psis_l"]) / 2}
    del sacrum["psis_r"]
    expected = anatomical_angles(marks, centres, "r")["hip"]
    np.testing.assert_allclose(anatomical_angles(sacrum, centres, "r")["hip"], expected, atol=1e-12)
    beside = {**marks, "sacrum": marks["psis_r"] + np.array([0.0, 0.05, 0.0])}
    np.testing.assert_array_equal(anatomical_angles(beside, centres, "r")["hip"], expected)


@pytest.mark.parametrize(
    ("missing", "joints"),
    [("psis_r", ("hip",)), ("heel_r", ("ankle",)), ("asis_l", ("hip", "knee", "ankle"))],
)
def test_what_is_not_marked_has_no_angle(missing, joints):
    marks, centres = person()
    del marks[missing]
    found = anatomical_angles(marks, centres, "r")
    assert tuple(name for name, angle in found.items() if angle is None) == joints


def test_the_foot_points_to_the_middle_of_its_metatarsal_heads():
    marks, centres = person()
    before = anatomical_angles(marks, centres, "r")["ankle"]
    marks["mt5_head_r"] = marks["mt5_head_r"] + np.array([0.0, 0.02, 0.0])
    raised = np.degrees(anatomical_angles(marks, centres, "r")["ankle"] - before)
    np.testing.assert_allclose(raised, np.degrees(np.arctan2(0.01, 0.17)), atol=0.01)
