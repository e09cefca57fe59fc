"""Motions as splines: exact derivatives, banded normal equations, a floor that accelerates."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from solver.kinematics.motion import Motion
from solver.simulate.feasible_motion import BlockBand
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.spline_motion import ACTIVE, MovingSupport, SplineMotion, coefficient_count
from solver.skeleton.pinocchio_model import RigidBodyModel


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


COUNT, DOFS, TIMES, RESIDUALS = 14, 3, 30, 4


@pytest.fixture
def problem():
    rng = np.random.default_rng(5)
    first = np.sort(rng.integers(0, COUNT - ACTIVE + 1, TIMES))
    rows = rng.normal(size=(TIMES, RESIDUALS, ACTIVE, DOFS))
    basis = rng.uniform(0.1, 1, (TIMES, ACTIVE))
    return rng, first, rows, basis


def spread(first, rows):
    dense = np.zeros((rows.shape[0] * rows.shape[1], COUNT * DOFS))
    for t, k in enumerate(first):
        block = rows[t].reshape(rows.shape[1], -1)
        dense[t * rows.shape[1] : (t + 1) * rows.shape[1], k * DOFS : (k + ACTIVE) * DOFS] = block
    return dense


def assembled(problem):
    rng, first, rows, basis = problem
    residual, own = rng.normal(size=(TIMES, RESIDUALS)), rng.normal(size=(TIMES, DOFS))
    slope = np.array([1.0, 2.0, 3.0])
    band = BlockBand(COUNT, DOFS)
    band.add_rows(first, rows, residual)
    band.add_diagonal(first, basis, own, slope)
    diagonal_rows = np.einsum("tk,d,de->tdke", basis, slope, np.eye(DOFS))
    J = np.concatenate([spread(first, rows), spread(first, diagonal_rows)])
    return band, J, np.concatenate([residual.ravel(), own.ravel()])


def test_solves_the_dense_normal_equations(problem):
    band, J, r = assembled(problem)
    np.testing.assert_allclose(band.gradient.ravel(), J.T @ r, atol=1e-9)
    solution = band.factor().solve(band.gradient.ravel())
    np.testing.assert_allclose(solution, np.linalg.lstsq(J, r, rcond=None)[0], rtol=1e-7, atol=1e-9)


def test_meets_constraints_at_the_least_price(problem):
    """Against the dense Karush-Kuhn-Tucker system."""
    rng = problem[0]
    band, J, r = assembled(problem)
    first = np.array([1, 4])
    constraints = rng.normal(size=(2, 3, ACTIVE, DOFS))
    violated = rng.normal(size=(2, 3))
    factor = band.factor()
    step = factor.onto_constraints(-factor.solve(band.gradient.ravel()), first, constraints, violated)
    C, H = spread(first, constraints), J.T @ J
    kkt = np.block([[H, C.T], [C, np.zeros((6, 6))]])
    expected = np.linalg.solve(kkt, -np.concatenate([J.T @ r, violated.ravel()]))[: COUNT * DOFS]
    np.testing.assert_allclose(step, expected, rtol=1e-6, atol=1e-8)


TIMES_SUPPORT = np.arange(0.0, 2.0, 0.01)
DIRECTION = np.array([0.8, 0.0, 0.6])
WAVES = ((0.4, 1.3, 0.2), (0.2, 2.9, 1.0))


def test_the_ground_carries_what_the_motion_in_the_room_demands(walk):
    """The same motion seen from a room that does not accelerate: the support's own path is added to it."""
    skeleton = walk.body.skeleton
    support = MovingSupport(skeleton, DIRECTION, WAVES)
    q, v, a = (x.copy() for x in walk.motion.state(TIMES_SUPPORT))
    places = [walk.motion.dofs.index(f"pelvis_t{axis}") for axis in "xyz"]
    path, speed, acceleration = (
        np.zeros(len(TIMES_SUPPORT)),
        np.zeros(len(TIMES_SUPPORT)),
        np.zeros(len(TIMES_SUPPORT)),
    )
    for amplitude, frequency, phase in WAVES:
        omega = 2 * np.pi * frequency
        path -= amplitude / omega**2 * np.sin(omega * TIMES_SUPPORT + phase)
        speed -= amplitude / omega * np.cos(omega * TIMES_SUPPORT + phase)
        acceleration += amplitude * np.sin(omega * TIMES_SUPPORT + phase)
    np.testing.assert_allclose(support.acceleration(TIMES_SUPPORT), acceleration[:, None] * DIRECTION)
    demand = GroundDemand(RigidBodyModel(skeleton))
    on_support = demand.wrench(q, v, a) - support(walk.motion, TIMES_SUPPORT)
    for state, time_history in ((q, path), (v, speed), (a, acceleration)):
        state[:, places] += time_history[:, None] * DIRECTION
    in_room = demand.wrench(q, v, a)
    shift = path[:, None] * DIRECTION
    in_room[:, 3:] -= np.cross(shift, in_room[:, :3])
    np.testing.assert_allclose(on_support, in_room, atol=1e-6)
