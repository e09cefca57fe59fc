import numpy as np
import pytest
from scipy.interpolate import BSpline

from solver.dynamics.trajectory.spline_basis import spline_basis


@pytest.mark.parametrize(("frames", "spacing"), [(21, 2), (20, 2), (31, 5), (7, 1), (2, 2)])
def test_equals_scipys_splines(frames, spacing):
    rate = 50.0
    basis = spline_basis(frames, rate, spacing)
    rng = np.random.default_rng(frames)
    coefficients = rng.normal(size=(basis.coefficients, 3))
    knots = (np.arange(-5, basis.coefficients + 1) * spacing) / rate
    spline = BSpline(knots, coefficients, 5)
    times = np.arange(frames) / rate
    for order in range(3):
        np.testing.assert_allclose(
            basis.evaluate(coefficients, order), spline(times, nu=order), rtol=1e-9, atol=1e-9
        )


def test_jerk_gram_is_the_integral_of_the_squared_third_derivative():
    basis = spline_basis(23, 100.0, 2)
    rng = np.random.default_rng(0)
    c = rng.normal(size=basis.coefficients)
    knots = (np.arange(-5, basis.coefficients + 1) * 2) / 100.0
    end = (basis.coefficients - 5) * 2 / 100.0
    fine = np.linspace(0, end, 40001)
    jerk = BSpline(knots, c, 5)(fine, nu=3)
    numerical = np.trapezoid(jerk**2, fine)
    full = sum(
        (1 if k == 0 else 2) * (c[: len(c) - k] * c[k:] * basis.jerk_gram[: len(c) - k, k]).sum()
        for k in range(6)
    )
    assert full == pytest.approx(numerical, rel=1e-6)
