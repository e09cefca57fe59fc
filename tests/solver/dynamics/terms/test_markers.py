"""Markers that are all trusted, as rows of errors and of their changes."""

import numpy as np

from solver.dynamics.terms.markers import Markers
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.skeleton.forward import ForwardKinematics, marker_positions

TRUSTING = TrajectorySettings(marker_robust_scale_m=1e3)


def test_gauss_newton_is_that_of_dense_rows(case):
    observed, rate = case.data.observed_ground, case.data.start.rate

    def rows(iterate):
        error = marker_positions(case.skeleton, case.at(iterate).q) - observed
        changes = np.diff(error, axis=0) / (TRUSTING.marker_drift_std_m_s / rate)
        both = np.concatenate([error.ravel() / TRUSTING.marker_std_m, changes.ravel()])
        return np.sqrt(case.frame_weight) * both[np.isfinite(both)]

    case.assert_least_squares(
        Markers(ForwardKinematics(case.skeleton), observed, case.data.start, TRUSTING), rows
    )


def test_a_marker_far_off_says_less(case):
    usual = TrajectorySettings()
    far = case.data.observed_ground.copy()
    far[:, 0] += 1.0
    at, kinematics = case.at(case.iterate), ForwardKinematics(case.skeleton)
    trusting, robust = (
        Markers(kinematics, far, case.data.start, settings).cost(at) for settings in (TRUSTING, usual)
    )
    assert robust < 0.2 * trusting
