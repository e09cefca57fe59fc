from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.marker_effect import pose_free
from solver.skeleton.forward import ForwardKinematics, marker_jacobian

SOFT_TISSUE = 1.5


@pytest.fixture(scope="module")
def still(tracked, scene):
    """Markers just where the model has them."""
    return tracked(scene.markers.model_ground + 0.0 * scene.markers.observed_ground)


def test_no_change_of_pose_is_left(still, tracked, scene):
    rng = np.random.default_rng(1)
    q = still.motion.q.copy()
    few = np.arange(len(q)) % 10 == 0  # so that usual places stay
    q[few] += 1e-4 * rng.standard_normal(q[few].shape)
    kinematics = ForwardKinematics(still.skeleton)
    moved = kinematics.markers(kinematics.poses(q)) + 0.0 * scene.markers.observed_ground
    free = pose_free(replace(still, markers=replace(still.markers, observed_ground=moved)), SOFT_TISSUE)
    error = np.nanstd((moved - still.markers.model_ground)[few])
    assert np.abs(free.score_body).max() < 0.01 * error


def test_a_marker_is_where_the_others_do_not_put_it(still):
    """Leave-one-out by formula against the fit without the marker."""
    m = still.markers.names.index("RTH1")
    rng = np.random.default_rng(2)
    noisy = still.markers.observed_ground + 0.002 * rng.standard_normal(still.markers.observed_ground.shape)
    seen = replace(still, markers=replace(still.markers, observed_ground=noisy))
    free = pose_free(seen, 1e-3)
    apart = np.linalg.solve(free.information_body[:, m], free.score_body[:, m][..., None])[..., 0]
    without = noisy.copy()
    without[:, m] = np.nan
    predicted = _fitted_alone(still, without)[:, m]
    expected = np.einsum("tji,tj->ti", still.R_ground_body[:, still.markers.body[m]], noisy[:, m] - predicted)
    difference = (apart - apart.mean(axis=0)) - (expected - expected.mean(axis=0))
    assert np.sqrt(np.mean(difference**2)) < 0.2 * np.sqrt(np.mean((expected - expected.mean(axis=0)) ** 2))


def _fitted_alone(scene, observed):
    """Model markers after a linear least-squares fit to each frame, equal weights, written out densely."""
    kinematics = ForwardKinematics(scene.skeleton)
    poses = kinematics.poses(scene.motion.q)
    x = kinematics.markers(poses)
    J = marker_jacobian(kinematics, poses, x)
    error = (observed - x).reshape(len(x), -1)
    placed = x.copy()
    for t in range(len(x)):
        known = np.isfinite(error[t])
        step = np.linalg.lstsq(
            np.vstack([J[t, known], 1e-2 * np.eye(J.shape[2])]),
            np.r_[error[t, known], np.zeros(J.shape[2])],
            rcond=None,
        )[0]
        placed[t] += (J[t] @ step).reshape(-1, 3)
    return placed
