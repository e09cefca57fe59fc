"""Distances that a moving body keeps, against distances on its segments as they are defined."""

import numpy as np
import pytest

from solver.kinematics.label_faults.rigid_neighbours import on_near_segments, on_one_segment, rigid_neighbours
from solver.kinematics.label_faults.settings import LabelRepairSettings

SETTINGS = LabelRepairSettings()


@pytest.fixture
def rigid(swinging, crane):
    return rigid_neighbours(swinging.positions_ground, crane)


def test_usual_distances_are_those_on_the_segment(rigid, crane):
    for a, b in [(0, 1), (2, 3), (11, 13)]:
        one, other = crane.markers[a], crane.markers[b]
        assert one.body == other.body
        true = np.linalg.norm(one.position_body - other.position_body)
        assert rigid.usual_m[a, b] == pytest.approx(true, abs=0.001)


def test_with_enough_markers_of_its_own_a_segment_needs_no_other(rigid, crane):
    body = [marker.body for marker in crane.markers]
    for m in range(4):  # the pelvis has four
        assert set(rigid.of(m)) == {i for i in range(4) if i != m}
        assert {body[i] for i in rigid.of(m)} == {0}


def test_near_segments_are_those_between_which_no_other_is_marked(crane):
    bodies = np.array([marker.body for marker in crane.markers])
    near = on_near_segments(crane)
    names = {name: int(np.flatnonzero(bodies == crane.body_index(name))[0]) for name in crane.body_names}
    assert near[names["pelvis"], names["femur_r"]]
    assert near[names["tibia_r"], names["foot_r"]]
    assert not near[names["pelvis"], names["tibia_r"]]
    assert not near[names["foot_r"], names["arm_r"]]
    assert (near == near.T).all()
    assert (near | ~on_one_segment(crane)).all()


def test_how_far_off_a_point_is(rigid, swinging):
    x = swinging.positions_ground
    here, known = rigid.off_m(0, x[:, 0])
    assert (known == 3).all()
    assert np.median(here) < 0.003
    moved = x[:, 0] + np.array([0.0, 0.3, 0.0])
    off, _ = rigid.off_m(0, moved)
    by_hand = [np.linalg.norm(moved - x[:, j], axis=1) - rigid.usual_m[0, j] for j in (1, 2, 3)]
    np.testing.assert_allclose(off, np.sqrt(np.mean(np.square(by_hand), axis=0)))


def test_a_neighbour_that_left_its_own_neighbours_has_no_say(swinging, crane):
    x = swinging.positions_ground.copy()
    x[100:150, 1] += 1.0
    x[120, 2] = np.nan
    rigid = rigid_neighbours(x, crane)
    off, known = rigid.off_m(0, x[:, 0])
    assert np.nanmax(off) < 0.008
    assert (known[100:120] == 2).all()
    assert np.isnan(off[120])
    assert rigid.off_m(0, x[:, 0], trust=False)[0][110] > 0.05
