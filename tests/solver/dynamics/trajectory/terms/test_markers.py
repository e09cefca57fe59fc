"""Markers that are all trusted, as rows of errors and of their changes, whitened by a dense covariance."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.trajectory.bordered_system import TrialGradient
from solver.dynamics.trajectory.marker_error_levels import marker_error_levels
from solver.dynamics.trajectory.terms.markers import SLOW_ERROR_FACTOR, Markers
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.skeleton.forward import ForwardKinematics, marker_positions

TRUSTING = TrajectorySettings(marker_robust_scale_m=1e3)


@pytest.mark.slow
@pytest.mark.parametrize("shared", [0.0, 1.5])
def test_gauss_newton_is_that_of_dense_rows(case, shared):
    observed, rate = case.data.observed_ground, case.data.start.rate
    settings = replace(TRUSTING, shared_growth=shared, growth_factor=1.3)
    kinematics = ForwardKinematics(case.skeleton)
    levels = marker_error_levels(kinematics, observed, case.data.start, settings)
    seen, bodies = np.isfinite(observed).all(axis=2), kinematics.marker_bodies

    def whitened(change, pair):
        """Changes of one pair of frames, by the inverse root of their covariance."""
        found = []
        for body in np.unique(bodies):
            here = seen[pair] & seen[pair + 1] & (bodies == body)
            if here.any():
                variance = (1.3 * levels.growth_m[here]) ** 2 / rate
                covariance = np.diag(variance) + shared**2 * variance.mean()
                found.append(np.linalg.solve(np.linalg.cholesky(covariance), change[here]).ravel())
        return np.concatenate(found)

    def rows(iterate):
        error = marker_positions(case.skeleton, case.at(iterate).q) - observed
        slow = error / (SLOW_ERROR_FACTOR * levels.slow_m[:, None]) * np.sqrt(case.frame_weight)
        changes = [whitened(error[t + 1] - error[t], t) for t in range(len(error) - 1)]
        return np.concatenate([slow[np.isfinite(slow)], *changes])

    case.assert_least_squares(Markers(kinematics, observed, case.data.start, settings, levels), rows)


def test_a_marker_far_off_says_less(case):
    """Its pull grows with its distance, but for the robust loss."""
    kinematics, at = ForwardKinematics(case.skeleton), case.at(case.iterate)

    def pulled(distance_m):
        far = case.data.observed_ground.copy()
        far[:, 0] += distance_m
        settings = replace(TrajectorySettings(), growth_factor=1e4)
        levels = marker_error_levels(kinematics, far, case.data.start, settings)
        term = Markers(kinematics, far, case.data.start, settings, levels)
        gradient = TrialGradient.zero(at.coefficients.shape, at.shared.count)
        term.add_gradient(at, gradient)
        return np.abs(gradient.coefficients).max()

    assert pulled(1.0) < 0.5 * pulled(TrajectorySettings().marker_robust_scale_m)
