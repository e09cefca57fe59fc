import numpy as np

from solver.dynamics.trajectory.block_tridiagonal import BlockTridiagonal


def dense(matrix):
    blocks, size, _ = matrix.diagonal.shape
    A = np.zeros((blocks * size, blocks * size))
    for i in range(blocks):
        at = slice(i * size, (i + 1) * size)
        A[at, at] = matrix.diagonal[i]
        if i + 1 < blocks:
            below = slice((i + 1) * size, (i + 2) * size)
            A[below, at] = matrix.below[i]
            A[at, below] = matrix.below[i].T
    return A


def synthetic(blocks=5, size=4, seed=0):
    rng = np.random.default_rng(seed)
    diagonal = rng.normal(size=(blocks, size, size))
    diagonal = diagonal @ diagonal.transpose(0, 2, 1) + 10 * np.eye(size)
    return BlockTridiagonal(diagonal, rng.normal(size=(blocks, size, size)))


def test_solve_equals_the_dense_one():
    matrix, right = synthetic(), np.random.default_rng(1).normal(size=(5, 4, 3))
    expected = np.linalg.solve(dense(matrix), right.reshape(20, 3))
    factor = matrix.factorized_in_place()
    x = factor.back_solve(factor.half_solve(right))
    np.testing.assert_allclose(x.reshape(20, 3), expected, atol=1e-10)


def test_inner_products_of_half_solves_are_those_of_the_inverse():
    matrix, border = synthetic(seed=2), np.random.default_rng(3).normal(size=(5, 4, 2))
    flat = border.reshape(20, 2)
    expected = flat.T @ np.linalg.solve(dense(matrix), flat)
    half = matrix.factorized_in_place().half_solve(border).reshape(20, 2)
    np.testing.assert_allclose(half.T @ half, expected, atol=1e-10)


def test_product():
    matrix, x = synthetic(seed=4), np.random.default_rng(5).normal(size=(5, 4, 2))
    np.testing.assert_allclose(matrix.times(x).reshape(20, 2), dense(matrix) @ x.reshape(20, 2), atol=1e-10)
