"""Cholesky of a symmetric block-tridiagonal matrix: time's band, in blocks that suit matrix products."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve, cholesky, solve_triangular


@dataclass(frozen=True)
class BlockTridiagonal:
    """A symmetric matrix: `diagonal[i]` on the diagonal, `below[i]` at block (i + 1, i)."""

    diagonal: Float[np.ndarray, "blocks size size"]
    below: Float[np.ndarray, "blocks size size"]  # the last one is not used

    def factorized(self) -> "BlockCholesky":
        """L with L Lᵀ = the matrix; `numpy.linalg.LinAlgError` where it is not positive definite."""
        L = np.empty_like(self.diagonal)
        G = np.empty_like(self.below)
        schur = self.diagonal[0]
        for i in range(len(L)):
            L[i] = cholesky(schur, lower=True, check_finite=False)
            if i + 1 < len(L):
                G[i] = solve_triangular(L[i], self.below[i].T, lower=True, check_finite=False).T
                schur = self.diagonal[i + 1] - G[i] @ G[i].T
        return BlockCholesky(L, G)

    def times(self, x: Float[np.ndarray, "blocks size columns"]) -> Float[np.ndarray, "blocks size columns"]:
        """The matrix times columns."""
        product = self.diagonal @ x
        product[1:] += self.below[:-1] @ x[:-1]
        product[:-1] += self.below[:-1].transpose(0, 2, 1) @ x[1:]
        return product


@dataclass(frozen=True)
class BlockCholesky:
    """The factor of a block-tridiagonal matrix."""

    L: Float[np.ndarray, "blocks size size"]
    G: Float[np.ndarray, "blocks size size"]

    def half_solve(
        self, right: Float[np.ndarray, "blocks size columns"]
    ) -> Float[np.ndarray, "blocks size columns"]:
        """L⁻¹ right: its columns' inner products are those of the inverse matrix."""
        y = np.empty_like(right)
        carried = right[0]
        for i in range(len(self.L)):
            y[i] = solve_triangular(self.L[i], carried, lower=True, check_finite=False)
            if i + 1 < len(self.L):
                carried = right[i + 1] - self.G[i] @ y[i]
        return y

    def back_solve(
        self, y: Float[np.ndarray, "blocks size columns"]
    ) -> Float[np.ndarray, "blocks size columns"]:
        """L⁻ᵀ y."""
        x = np.empty_like(y)
        carried = y[-1]
        for i in range(len(self.L) - 1, -1, -1):
            x[i] = solve_triangular(self.L[i], carried, lower=True, trans="T", check_finite=False)
            if i:
                carried = y[i - 1] - self.G[i - 1].T @ x[i]
        return x


def solve_bordered(
    matrix: BlockTridiagonal,
    border: Float[np.ndarray, "blocks size parameters"],
    corner: Float[np.ndarray, "parameters parameters"],
    right: Float[np.ndarray, "blocks size"],
    right_corner: Float[np.ndarray, " parameters"],
) -> tuple[Float[np.ndarray, "blocks size"], Float[np.ndarray, " parameters"]]:
    """Solve [[matrix, border], [borderᵀ, corner]] [x; θ] = [right; right_corner].

    Raises:
        numpy.linalg.LinAlgError: the system is not positive definite.
    """
    factor = matrix.factorized()
    half = factor.half_solve(np.concatenate([border, right[:, :, None]], axis=2))
    half_border, half_right = half[:, :, :-1], half[:, :, -1]
    flat_border, flat_right = half_border.reshape(right.size, -1 if border.size else 0), half_right.ravel()
    schur = corner - flat_border.T @ flat_border
    theta = np.zeros(0)
    if len(corner):
        factor_corner = cholesky(schur, lower=True, check_finite=False), True
        theta = cho_solve(factor_corner, right_corner - flat_border.T @ flat_right, check_finite=False)
    x = factor.back_solve((half_right - half_border @ theta)[:, :, None])[:, :, 0]
    return x, theta
