import numpy as np
import pytest

from solver.skeleton.segment_tables import hip_centre, lengths, segment_shape

SINGLE = ("head", "upper_trunk", "middle_trunk", "lower_trunk")
PAIRED = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")


@pytest.mark.parametrize("sex", ["male", "female", None])
def test_segments_make_up_the_whole_body(sex):
    total = sum(segment_shape(name, sex).mass for name in SINGLE)
    total += 2 * sum(segment_shape(name, sex).mass for name in PAIRED)
    assert total == pytest.approx(1.0, abs=1e-12)


def test_unknown_sex_lies_between():
    for name in SINGLE + PAIRED:
        masses = [segment_shape(name, sex).mass for sex in ("male", "female", None)]
        assert min(masses[:2]) - 1e-4 <= masses[2] <= max(masses[:2]) + 1e-4


@pytest.mark.parametrize("sex", ["male", "female", None])
def test_legs_trunk_and_head_add_up_to_the_stature(sex):
    of = lengths(1.68, sex)
    assert of.hip_height + of.c7_above_hips + of.head == pytest.approx(1.68, abs=1e-12)
    assert of.navel_above_hips + sum(of.trunk_above_navel) < of.c7_above_hips


def test_hip_centres_are_as_far_apart_as_in_adults():
    """Between 16 and 19 cm (Harrington et al. 2007; Seidel et al. 1995)."""
    hip = hip_centre(lengths(1.74, None))
    assert 0.16 < 2 * hip[2] < 0.19
    assert -0.08 < hip[0] < -0.03
    assert -0.10 < hip[1] < -0.06
    np.testing.assert_array_less(hip_centre(lengths(1.5, None))[2], hip[2])
