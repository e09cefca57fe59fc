"""Columns of learnt terms against independent statements: mirrored, periodic, turned with the recording."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.dynamics.force_prediction.learnt_columns import (
    Footfalls,
    constant_columns,
    footfalls,
    gain_columns,
    gain_notes,
    heading_frame,
    periodic_splines,
    smooth_demand,
    step_columns,
    step_phases,
)
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.material_acceleration import required_ground
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics
from tests.solver.dynamics.force_prediction.conftest import FEET, HEADING_DEG, RATE

SETTINGS = PredictionSettings()


def turned(skeleton, motion, degrees):
    """The whole recording turned about the vertical through the origin.

    Not to the last digit: the low-pass sees the pelvis's angles, which mix otherwise in another heading.
    """
    turn = Rotation.from_euler("y", degrees, degrees=True).as_matrix()
    poses, root = ForwardKinematics(skeleton).poses(motion.q), root_joint(skeleton)
    q = motion.q.copy()
    R, p = turn @ poses.R_ground_body[:, root.body], poses.p_ground_body[:, root.body] @ turn.T
    q[:, root.dofs] = root.coordinates(R, p)
    return replace(motion, q=q), turn


def all_columns(walk, motion):
    skeleton, frame = walk.skeleton, heading_frame(walk.skeleton, motion)
    known = np.ones(motion.frames, dtype=bool)
    falls = footfalls(skeleton, motion, frame, feet=FEET, in_contact=walk.in_contact, known=known)
    phases = step_phases(falls, motion.frames)
    demand = smooth_demand(skeleton, motion, frame)
    return [
        step_columns(phases, frame, 800.0),
        gain_columns(demand, motion.rate, frame, SETTINGS),
        constant_columns(frame, 700.0),
    ]


def test_the_frame_heads_where_the_person_walks(hidden_wrench_walk):
    frame = heading_frame(hidden_wrench_walk.skeleton, hidden_wrench_walk.motion)
    turn = Rotation.from_euler("y", HEADING_DEG, degrees=True).as_matrix()
    off = Rotation.from_matrix(frame.R_ground_heading @ turn.T).magnitude()
    assert np.degrees(off).max() < 6
    assert np.abs(np.linalg.det(frame.R_ground_heading) - 1).max() < 1e-12


def test_a_wrench_there_and_back(hidden_wrench_walk):
    frame = heading_frame(hidden_wrench_walk.skeleton, hidden_wrench_walk.motion)
    wrench = np.random.default_rng(2).normal(size=(hidden_wrench_walk.motion.frames, 6))
    back = frame.to_ground(frame.from_ground(wrench)[:, :, None])[:, :, 0]
    np.testing.assert_allclose(back, wrench, atol=1e-12)


@pytest.mark.parametrize("degrees", [90.0, -143.0])
def test_columns_turn_with_the_recording(hidden_wrench_walk, degrees):
    motion, turn = turned(hidden_wrench_walk.skeleton, hidden_wrench_walk.motion, degrees)
    before = all_columns(hidden_wrench_walk, hidden_wrench_walk.motion)
    for one, other in zip(before, all_columns(hidden_wrench_walk, motion), strict=True):
        parts = one.ground.reshape(len(one.ground), 2, 3, -1)
        expected = np.einsum("ij,tpjn->tpin", turn, parts).reshape(one.ground.shape)
        off = one.prior_std * np.sqrt(((other.ground - expected) ** 2).mean(axis=(0, 1)))
        assert off.max() < 0.5  # N or N·m; those of the columns are up to 70
        np.testing.assert_array_equal(one.prior_std, other.prior_std)


def test_splines_are_periodic_and_sum_to_one():
    phase = np.linspace(0, 1, 200, endpoint=False)
    splines = periodic_splines(phase, 14)
    np.testing.assert_allclose(splines.sum(axis=1), 1.0)
    np.testing.assert_allclose(periodic_splines(phase + 1, 14), splines, atol=1e-12)
    shifted = periodic_splines(phase + 1 / 14, 14)
    np.testing.assert_allclose(shifted, np.roll(splines, 1, axis=1), atol=1e-12)
    assert not periodic_splines(np.array([np.nan]), 14).any()


def test_a_left_step_is_the_right_one_in_a_mirror(hidden_wrench_walk):
    """In the plane of symmetry a mirror turns force z, and of the moment, which is axial, x and y."""
    walk = hidden_wrench_walk
    frame = heading_frame(walk.skeleton, walk.motion)
    falls = Footfalls(np.array([50.0, 100.0, 150.0, 200.0]), np.array([0, 1, 0, 1]))
    columns = step_columns(step_phases(falls, walk.motion.frames), frame, 800.0)
    x = np.random.default_rng(3).normal(size=len(columns.prior_std))
    wrench = frame.from_ground(columns.ground @ x)
    right, left = wrench[50:100], wrench[100:150]
    mirror = np.diag([1.0, 1.0, -1.0])
    np.testing.assert_allclose(left[:, :3], right[:, :3] @ mirror, atol=1e-9)
    np.testing.assert_allclose(left[:, 3:], -right[:, 3:] @ mirror, atol=1e-9)
    np.testing.assert_allclose(wrench[150:200], right, atol=1e-9)


def test_where_nobody_steps_there_is_no_curve(hidden_wrench_walk):
    """After a pause, and where the same foot falls twice."""
    frame = heading_frame(hidden_wrench_walk.skeleton, hidden_wrench_walk.motion)
    falls = Footfalls(np.array([20.0, 70.0, 120.0, 240.0, 290.0, 340.0]), np.array([0, 1, 0, 1, 1, 0]))
    columns = step_columns(step_phases(falls, 401), frame, 800.0)
    stepping = columns.ground.any(axis=(1, 2))
    assert stepping[20:120].all()
    assert not stepping[120:290].any()
    assert stepping[290:390].all()
    assert not stepping[391:].any()
    assert step_phases(Footfalls(np.array([20.0]), np.array([0])), 401) is None


def test_gains_are_a_heavier_and_a_later_body(hidden_wrench_walk):
    """A share more, and a delay, of the demand are the gains' own columns; by a shifted motion."""
    walk = hidden_wrench_walk
    frame = heading_frame(walk.skeleton, walk.motion)
    demand = smooth_demand(walk.skeleton, walk.motion, frame)
    columns = gain_columns(demand, RATE, frame, SETTINGS)
    heavier = frame.from_ground(columns.ground @ (0.05 * np.tile([1.0, 0, 0], 6)))
    np.testing.assert_allclose(heavier, 0.05 * demand, atol=1e-8)
    lag_s = 0.004
    later = frame.from_ground(columns.ground @ np.tile([0.0, -lag_s, lag_s**2 / 2], 6))
    t = np.arange(len(demand)) / RATE
    delayed = np.stack([np.interp(t - lag_s, t, axis) for axis in demand.T], axis=1)
    inside = slice(20, -20)
    error = np.abs(later - (delayed - demand))[inside].max(axis=0)
    assert (error < 0.15 * np.abs(delayed - demand)[inside].max(axis=0)).all()


def test_demand_is_what_the_ground_gives(hidden_wrench_walk):
    walk = hidden_wrench_walk
    inside = np.arange(20, walk.motion.frames - 20)
    required = required_ground(walk.skeleton, walk.motion)[inside]
    assert np.abs(required - walk.wrench_ground[inside])[:, :3].max() < 3


def test_notes_name_a_gain_and_a_lag_beyond_their_uncertainty():
    x, std = np.zeros(18), np.tile([0.01, 0.001, 1e-5], 6)
    assert gain_notes(x, std) == ()
    x[3], x[4] = 0.05, 0.006  # vertical
    (note,) = gain_notes(x, std)
    assert "vertical force -5 ± 2 %, vertical force 6 ± 2 ms late" in note
    assert gain_notes(x, 5 * std) == ()
