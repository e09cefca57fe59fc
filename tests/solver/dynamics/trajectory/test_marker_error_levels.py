"""Levels of marker errors that were drawn with known ones, on a crane that moves."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.trajectory import marker_error_levels as levels_module
from solver.dynamics.trajectory.marker_error_levels import (
    USUAL_MARKER_GROWTH_M,
    USUAL_MARKER_SLOW_M,
    marker_error_levels,
)
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics

RATE, FRAMES = 100.0, 4000
SETTINGS = TrajectorySettings(marker_robust_scale_m=1e3)


@pytest.fixture(autouse=True)
def each_segment_for_itself(monkeypatch):
    """The motion is exact here: no fit has taken a share of the errors, and none is given back."""
    monkeypatch.setattr(levels_module, "SEGMENT_PRIOR_MARKERS", 1e-6)


@pytest.fixture(scope="module")
def crane_at_work(crane, crane_q):
    """The crane's motion, its kinematics, and what errors in the segments' frames are in the ground's."""
    turns = np.arange(FRAMES)[:, None] / RATE
    q = crane_q[0] + 0.3 * np.sin(turns * np.linspace(0.7, 1.9, len(crane.dofs)))
    kinematics = ForwardKinematics(crane)
    poses = kinematics.poses(q)
    R = poses.R_ground_body[:, kinematics.marker_bodies]

    def observed(error_body):
        return kinematics.markers(poses) - np.einsum("tmij,tmj->tmi", R, error_body)

    return Motion(crane.dofs, q, RATE), kinematics, observed


def given_back(motion, markers):
    return 1 - motion.q.shape[1] / (3 * markers)


def walks(rng, growth_m, markers, rate=RATE):
    return np.cumsum(rng.normal(0, growth_m / np.sqrt(rate), (FRAMES, markers, 3)), axis=0)


def test_growth_is_that_of_the_random_walk_and_of_each_segment(crane_at_work):
    motion, kinematics, observed = crane_at_work
    bodies = kinematics.marker_bodies
    growth_m = np.where(bodies == bodies.max(), 0.02, 0.005)
    error = walks(np.random.default_rng(1), growth_m[:, None], len(bodies))
    levels = marker_error_levels(kinematics, observed(error), motion, SETTINGS)
    expected = growth_m / np.sqrt(given_back(motion, len(bodies)))
    np.testing.assert_allclose(levels.growth_m, expected, rtol=0.15)


def test_slow_movement_of_skin_is_a_size_and_no_growth(crane_at_work):
    motion, kinematics, observed = crane_at_work
    markers = len(kinematics.marker_bodies)
    slow = 0.01 * np.sin(2 * np.pi * 0.5 * motion.times)[:, None, None] * np.ones((1, markers, 3))
    levels = marker_error_levels(kinematics, observed(slow), motion, SETTINGS)
    np.testing.assert_allclose(
        levels.slow_m, 0.01 / np.sqrt(2) / np.sqrt(given_back(motion, markers)), rtol=0.02
    )
    # A random walk that moves as far in half a period would grow by 1 cm per root second.
    assert levels.growth_m.max() < 0.1 * 0.01


def test_where_a_marker_lies_on_the_segment_is_no_error(crane_at_work):
    motion, kinematics, observed = crane_at_work
    markers = len(kinematics.marker_bodies)
    constant = np.ones((FRAMES, markers, 3)) * 0.03
    levels = marker_error_levels(kinematics, observed(constant), motion, SETTINGS)
    np.testing.assert_allclose(levels.slow_m, SETTINGS.least_marker_slow_m)
    np.testing.assert_allclose(levels.growth_m, SETTINGS.least_marker_growth_m)


def test_gaps_change_little(crane_at_work):
    motion, kinematics, observed = crane_at_work
    markers = len(kinematics.marker_bodies)
    error = walks(np.random.default_rng(2), 0.01, markers)
    whole = observed(error)
    gaps = whole.copy()
    gaps[100:160, 0] = np.nan
    gaps[::7, 1] = np.nan
    a, b = (marker_error_levels(kinematics, x, motion, SETTINGS) for x in (whole, gaps))
    np.testing.assert_allclose(a.growth_m, b.growth_m, rtol=0.1)


def test_half_the_rate_tells_the_same_growth(crane_at_work):
    motion, kinematics, observed = crane_at_work
    markers = len(kinematics.marker_bodies)
    whole = observed(walks(np.random.default_rng(3), 0.01, markers))
    half = replace(motion, q=motion.q[::2], rate=RATE / 2)
    a = marker_error_levels(kinematics, whole, motion, SETTINGS)
    b = marker_error_levels(kinematics, whole[::2], half, SETTINGS)
    np.testing.assert_allclose(a.growth_m, b.growth_m, rtol=0.1)


def test_a_trial_too_short_to_tell_has_what_is_usual(crane_at_work):
    motion, kinematics, observed = crane_at_work
    markers = len(kinematics.marker_bodies)
    short = replace(motion, q=motion.q[:8])
    levels = marker_error_levels(kinematics, observed(np.zeros((FRAMES, markers, 3)))[:8], short, SETTINGS)
    np.testing.assert_allclose(levels.slow_m, USUAL_MARKER_SLOW_M)
    np.testing.assert_allclose(levels.growth_m, USUAL_MARKER_GROWTH_M)
