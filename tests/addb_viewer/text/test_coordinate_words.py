"""Coordinates of models in words."""

import pytest

from addb_viewer.text.coordinate_words import (
    Coordinate,
    coordinate_in_words,
    motion_in_words,
    torque_in_words,
)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("hip_rotation_r", "right hip rotation"),
        ("knee_angle_l", "left knee angle"),
        ("pro_sup_l", "left forearm pronation"),
        ("lumbar_extension", "lumbar extension"),
        ("pelvis_ty", "pelvis height"),
        ("clav_prot", "clav prot"),
    ],
)
def test_coordinates_are_told_in_words(name, said):
    assert coordinate_in_words(name) == said


def test_what_grows_is_named_and_the_knees_range_tells_which_way_it_bends():
    assert motion_in_words("knee_angle_r", (0.0, 2.1)) == motion_in_words("knee_angle_l") == "knee flexion"
    assert motion_in_words("knee_angle_r", (-2.1, 0.17)) == "knee extension"  # gait2354
    assert motion_in_words("ankle_angle_l", (-1.6, 1.6)) == "ankle dorsiflexion"
    assert motion_in_words("hip_adduction_r", (-1.0, 0.4)) == "hip adduction"
    assert motion_in_words("pelvis_tx") == "pelvis position x"


def test_a_torque_is_named_by_what_it_moves():
    assert torque_in_words("knee_angle_r") == "right knee torque"
    assert torque_in_words("hip_rotation_l") == "left hip rotation torque"


def test_the_side_is_a_letter_at_the_end():
    assert Coordinate.named("arm_flex_r") == ("arm_flex", "right")
    assert Coordinate.named("lumbar_bending") == ("lumbar_bending", "")
    assert Coordinate.named("_r") == ("_r", "")
