"""The markers' trajectory of a long trial in windows, against the same trial as a whole."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.force_prediction.marker_posterior import (
    LongMarkerPosterior,
    marker_posterior,
    trial_posterior,
)
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.weighted_means import windows_over
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.skeleton.pinocchio_model import RigidBodyModel

pytestmark = pytest.mark.slow  # their fixtures take long

NOISE = replace(DiagnosisSettings().markers, memory_s=0.4)
WHOLE = TrajectorySettings()
IN_PARTS = replace(WHOLE, whole_frames=150, window_frames=140, overlap_frames=80)


@pytest.fixture(scope="module")
def seen(short_scene):
    exact = short_scene.markers.model_ground
    return exact + np.random.default_rng(3).normal(0, 0.002, exact.shape)


@pytest.fixture(scope="module")
def whole(short_scene, seen):
    return marker_posterior(short_scene.skeleton, seen, short_scene.motion, NOISE, WHOLE)


@pytest.fixture(scope="module")
def in_parts(short_scene, seen):
    return trial_posterior(short_scene.skeleton, seen, short_scene.motion, NOISE, IN_PARTS)


@pytest.fixture(scope="module")
def windows(short_scene):
    """All over the trial, borders of parts included."""
    return windows_over(np.ones(short_scene.motion.frames, dtype=bool), short_scene.rate, 0.03, 0.12)


@pytest.fixture(scope="module")
def covariances(short_scene, whole, in_parts, windows):
    return [p.wrench_covariance(short_scene.measured_ground, windows) for p in (whole, in_parts)]


def test_a_short_trial_stays_whole(short_scene, seen, whole):
    same = trial_posterior(short_scene.skeleton, seen, short_scene.motion, NOISE, WHOLE)
    np.testing.assert_array_equal(same.motion.q, whole.motion.q)


def test_the_wrench_is_that_of_the_whole(short_scene, whole, in_parts, windows, covariances):
    """To within a tenth of what the markers leave open."""
    assert isinstance(in_parts, LongMarkerPosterior)
    assert len(in_parts.parts) == 2
    assert in_parts.smoothness == whole.smoothness
    model, measured = RigidBodyModel(short_scene.skeleton), short_scene.measured_ground
    one, other = (
        windows.means(momentum_terms(model, p.motion.q, p.velocity, p.acceleration, measured).residual)
        for p in (whole, in_parts)
    )
    std = np.sqrt(np.diag(covariances[0])).reshape(-1, 6)
    assert np.abs((one - other) / std).max() < 0.1


def test_its_covariance_is_that_of_the_whole(covariances):
    """Near the border too, and between windows of both parts."""
    one, other = covariances
    std = np.sqrt(np.diag(one))
    np.testing.assert_allclose(np.sqrt(np.diag(other)), std, rtol=0.02)
    assert np.abs((one - other) / np.outer(std, std)).max() < 0.03
    assert np.linalg.eigvalsh(other)[0] > 0
