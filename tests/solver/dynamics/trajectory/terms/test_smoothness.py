"""The jerk of a spline by scipy, integrated piece by piece."""

import numpy as np
from scipy.interpolate import BSpline

from solver.dynamics.trajectory.spline_basis import DEGREE
from solver.dynamics.trajectory.terms.priors import Smoothness, jerk_level
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings

SETTINGS = TrajectorySettings()


def test_gauss_newton_is_that_of_dense_rows(case):
    basis, level = case.basis, jerk_level(case.data.start)
    width, pieces = basis.spacing / basis.rate, basis.coefficients - DEGREE
    knots = width * np.arange(-DEGREE, pieces + DEGREE + 1)
    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact: squares of parabolas
    t = (width * (np.arange(pieces)[:, None] + (nodes + 1) / 2)).ravel()
    share = np.tile(width * weights / 2, pieces)[:, None]

    def rows(iterate):
        jerk = BSpline(knots, case.at(iterate).coefficients, DEGREE)(t, nu=3)
        return (np.sqrt(SETTINGS.smoothness * share) * jerk / level).ravel()

    case.assert_least_squares(Smoothness(level, SETTINGS), rows)
