import numpy as np
import pytest

from solver.dynamics.trajectory.block_tridiagonal import BandCholesky


def synthetic(rows, seed=0, size=3, width=4):
    """A band's panels, and the whole matrix."""
    rng = np.random.default_rng(seed)
    panels = rng.normal(size=(rows, size, width, size))
    dense = np.zeros((rows, size, rows, size))
    for a in range(rows):
        own = panels[a, :, 0]
        panels[a, :, 0] = own + own.T + 30 * np.eye(size)
        for k in range(width):
            if a + k < rows:
                dense[a, :, a + k], dense[a + k, :, a] = panels[a, :, k], panels[a, :, k].T
            else:
                panels[a, :, k] = 0.0
    return panels, dense.reshape(rows * size, rows * size)


@pytest.mark.parametrize("rows", [1, 2, 3, 8, 9])
def test_solve_equals_the_dense_one(rows):
    panels, dense = synthetic(rows)
    right = np.random.default_rng(1).normal(size=(rows, 3, 2))
    expected = np.linalg.solve(dense, right.reshape(-1, 2))
    factor = BandCholesky.in_place(panels)
    x = factor.back_solve(factor.half_solve_in_place(right.copy()))
    np.testing.assert_allclose(x.reshape(-1, 2), expected, atol=1e-12)


def test_the_factor_times_its_transpose_is_the_matrix():
    panels, dense = synthetic(7, seed=2)
    U = np.zeros((7, 3, 7, 3))
    factor = BandCholesky.in_place(panels)
    for a in range(7):
        for k in range(min(4, 7 - a)):
            U[a, :, a + k] = factor.panels[a, :, k]
    U = U.reshape(21, 21)
    np.testing.assert_allclose(U.T @ U, dense, atol=1e-12)
    np.testing.assert_allclose(U, np.triu(U))


def test_inner_products_of_half_solves_are_those_of_the_inverse():
    panels, dense = synthetic(6, seed=3)
    border = np.random.default_rng(4).normal(size=(6, 3, 2))
    flat = border.reshape(-1, 2)
    expected = flat.T @ np.linalg.solve(dense, flat)
    half = BandCholesky.in_place(panels).half_solve_in_place(border.copy()).reshape(-1, 2)
    np.testing.assert_allclose(half.T @ half, expected, atol=1e-12)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    panels, _ = synthetic(5)
    panels[3, 1, 0, 1] = -5.0
    with pytest.raises(np.linalg.LinAlgError, match="rows 2 to 4"):
        BandCholesky.in_place(panels)
