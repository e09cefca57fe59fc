import numpy as np

from solver.dynamics.block_tridiagonal import BlockTridiagonal, solve_bordered


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


def made_up(blocks=5, size=4, seed=0):
    rng = np.random.default_rng(seed)
    diagonal = rng.normal(size=(blocks, size, size))
    diagonal = diagonal @ diagonal.transpose(0, 2, 1) + 10 * np.eye(size)
    return BlockTridiagonal(diagonal, rng.normal(size=(blocks, size, size)))


def test_bordered_solve_equals_the_dense_one():
    matrix, rng = made_up(), np.random.default_rng(1)
    border, right, right_corner = rng.normal(size=(5, 4, 3)), rng.normal(size=(5, 4)), rng.normal(size=3)
    corner = 20 * np.eye(3)
    x, theta = solve_bordered(matrix, border, corner, right, right_corner)
    flat = border.reshape(20, 3)
    whole = np.block([[dense(matrix), flat], [flat.T, corner]])
    expected = np.linalg.solve(whole, np.concatenate([right.ravel(), right_corner]))
    np.testing.assert_allclose(np.concatenate([x.ravel(), theta]), expected, atol=1e-10)


def test_without_a_border_and_the_product():
    matrix, rng = made_up(seed=2), np.random.default_rng(3)
    right = rng.normal(size=(5, 4))
    x, theta = solve_bordered(matrix, np.zeros((5, 4, 0)), np.zeros((0, 0)), right, np.zeros(0))
    assert theta.size == 0
    np.testing.assert_allclose(matrix.times(x[:, :, None])[:, :, 0], right, atol=1e-10)
    np.testing.assert_allclose(dense(matrix) @ x.ravel(), right.ravel(), atol=1e-10)
