import numpy as np
import pytest

from solver.simulate.spline_motion import ACTIVE
from solver.simulate.trajectory_fit import BlockBand

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
