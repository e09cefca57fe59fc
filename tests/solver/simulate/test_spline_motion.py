import numpy as np
import pytest
from scipy.interpolate import BSpline

from solver.kinematics.motion import Motion
from solver.simulate.spline_motion import SplineMotion, coefficient_count


@pytest.fixture
def motion():
    coefficients = np.random.default_rng(2).normal(size=(23, 3))
    return SplineMotion(("a", "b", "c"), coefficients, start=-0.4, spacing=0.03)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_agrees_with_scipy_from_the_first_knot_to_the_last(motion, order):
    knots = motion.start + motion.spacing * (np.arange(23 + 6) - 5)
    times = np.linspace(motion.start, motion.end, 101)
    expected = BSpline(knots, motion.coefficients, 5)(times, nu=order)
    np.testing.assert_allclose(motion.derivative(times, order), expected, rtol=1e-9, atol=1e-9 * 33.0**order)


def test_covers_the_duration_that_was_asked_for():
    count = coefficient_count(1.0, 0.03)
    assert SplineMotion(("a",), np.zeros((count, 1)), 0.0, 0.03).end >= 1.0


def test_frames_at_the_knots_give_the_motion_back_inside(motion):
    """The interpolating spline of sampled frames is the motion itself but near its free ends."""
    rate = 100.0  # every third frame is a knot
    times = motion.start + np.arange(round((motion.end - motion.start) * rate) + 1) / rate
    sampled = Motion(motion.dofs, motion.derivative(times, 0), rate, motion.start)
    np.testing.assert_allclose(
        sampled.acceleration[15:-15], motion.derivative(times, 2)[15:-15], atol=2e-3 * 1e3
    )
