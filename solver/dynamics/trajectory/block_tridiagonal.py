"""Cholesky of a symmetric block-tridiagonal matrix: time's band, in blocks that suit matrix products."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky, solve_triangular


@dataclass(frozen=True)
class BlockTridiagonal:
    """A symmetric matrix: `diagonal[i]` on the diagonal, `below[i]` at block (i + 1, i)."""

    diagonal: Float[np.ndarray, "blocks size size"]
    below: Float[np.ndarray, "blocks size size"]  # the last one is not used

    def factorized_in_place(self) -> "BlockCholesky":
        """L with L Lᵀ = the matrix, in its own place: half the memory, and the matrix is gone.

        Raises:
            numpy.linalg.LinAlgError: it is not positive definite.
        """
        L, G = self.diagonal, self.below
        for i in range(len(L)):
            L[i] = cholesky(L[i], lower=True, check_finite=False)
            if i + 1 < len(L):
                G[i] = solve_triangular(L[i], G[i].T, lower=True, check_finite=False).T
                L[i + 1] -= G[i] @ G[i].T
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

    @property
    def half_log_det(self) -> float:
        """Logarithm of |L|, half of that of the matrix's determinant."""
        return float(np.log(np.diagonal(self.L, axis1=1, axis2=2)).sum())

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
