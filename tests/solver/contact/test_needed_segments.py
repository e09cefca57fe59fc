"""What has to be seen before forces are predicted: both legs, of somebody whom the feet carry."""

import numpy as np
import pytest

from solver.contact.needed_segments import seen_legs, unseen_coordinates, why_not_predicted
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions

FEET = ("calcn_r", "calcn_l")
FRAMES = 20
LEG = ("femur", "tibia", "talus", "calcn", "toes")
TRUNK_AND_ARMS = ("torso", "humerus", "ulna", "radius", "hand")
BENT = {f"{name}_{side}": 1.5 for name in ("hip_flexion", "knee_angle") for side in "rl"}


@pytest.fixture(scope="module")
def body():
    return default_skeleton(height_m=1.72)


def posed(body, **angles):
    q = np.tile(body.default_q, (FRAMES, 1))
    for name, value in angles.items():
        q[:, body.dofs.index(name)] = value
    return q


def unseen(body, q, seen_bodies):
    observed = marker_positions(body, q)
    hidden = [not body.body_names[m.body].startswith(tuple(seen_bodies)) for m in body.markers]
    observed[:, hidden] = np.nan
    return unseen_coordinates(body, observed)


def why(body, q, seen_bodies):
    of = centre_of_mass_of(body, q)
    return why_not_predicted(body, q, unseen(body, q, seen_bodies), FEET, of)


@pytest.mark.parametrize(
    ("seen", "feet"),
    [
        (("humerus_r", "ulna_r", "radius_r", "hand_r"), ()),
        (("pelvis", *TRUNK_AND_ARMS), ()),
        (("pelvis", "torso", "femur"), ()),
        (("pelvis", *(f"{bone}_r" for bone in LEG)), ("calcn_r",)),
        (("pelvis", *LEG), FEET),
        (("pelvis", "femur", "tibia"), FEET),  # malleoli tell where the feet are
        (("pelvis", *LEG, *TRUNK_AND_ARMS), FEET),
    ],
)
def test_a_leg_is_seen_from_the_knee_down(body, seen, feet):
    q = posed(body)
    assert seen_legs(body, unseen(body, q, seen), FEET) == feet
    said = why(body, q, seen)
    assert bool(said) == (feet != FEET)
    assert all((foot in said) == (foot not in feet) for foot in FEET)


def test_only_joints_without_markers_beyond_them_are_unseen(body):
    q = posed(body)
    assert unseen(body, q, body.body_names) == ()
    without_legs = set(unseen(body, q, ("pelvis", *TRUNK_AND_ARMS)))
    assert without_legs == {d for d in body.dofs if d.startswith(("hip", "knee", "ankle", "subtalar", "mtp"))}


@pytest.mark.parametrize(
    ("angles", "carried_by_feet"),
    [
        ({}, True),
        ({"lumbar_extension": -0.9, "pelvis_tilt": -0.5, "hip_flexion_r": 0.5, "hip_flexion_l": 0.5}, True),
        (BENT | {f"ankle_angle_{s}": 0.5 for s in "rl"} | {"pelvis_tilt": -0.6}, True),  # a deep squat
        (BENT, False),  # on a chair
        ({"knee_angle_r": 1.6, "knee_angle_l": 1.6}, False),  # kneeling
        ({"pelvis_tilt": 1.57}, False),  # on one's back
    ],
)
def test_forces_are_predicted_only_for_whom_the_feet_carry(body, angles, carried_by_feet):
    said = why(body, posed(body, **angles), body.body_names)
    assert (said == "") == carried_by_feet
    assert carried_by_feet or "sits" in said


def test_who_stands_up_is_not_seated(body):
    q = posed(body, **BENT)
    q[FRAMES // 2 :] = posed(body)[FRAMES // 2 :]
    assert why(body, q, body.body_names) == ""
