"""Cholesky of symmetric block-tridiagonal matrices and block bands: time's band, in blocks that suit BLAS.

BLAS works in place where a matrix is laid out by columns. Blocks here are laid out by rows, so it is given
transposes: Uᵀ is lower triangular, and Uᵀ Y = R reads Yᵀ U = Rᵀ.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dpotrf

BLOCK_ROWS_TOGETHER = 2  # block rows; matrix products want large blocks, the band's edge small ones


@dataclass(frozen=True)
class BandCholesky:
    """U with UᵀU = the matrix: `panels[a, :, k]` is its block (a, a + k)."""

    panels: Float[np.ndarray, "rows size width size"]

    @classmethod
    def in_place(cls, panels: Float[np.ndarray, "rows size width size"]) -> "BandCholesky":
        """Of a matrix with the upper band `panels`, which is gone afterwards.

        Args:
            panels: as U's are; blocks beyond the matrix zero, of the diagonal blocks the upper triangles.

        Raises:
            numpy.linalg.LinAlgError: the matrix is not positive definite.
        """
        count, size, width, _ = panels.shape
        for low in range(0, count, BLOCK_ROWS_TOGETHER):
            rows = panels[low : low + BLOCK_ROWS_TOGETHER]
            some, inner = len(rows), len(rows) * size
            wide = np.zeros((some, size, some + width - 1, size))
            for i in range(some):
                wide[i, :, i : i + width] = rows[i]
            wide = wide.reshape(inner, -1)
            own, right = wide[:, :inner].copy(), wide[:, inner:].copy()
            _, failed = dpotrf(own.T, lower=1, clean=1, overwrite_a=1)
            if failed:
                raise np.linalg.LinAlgError(f"block rows {low} to {low + some} are not positive definite")
            dtrsm(1.0, own.T, right.T, side=1, lower=1, trans_a=1, overwrite_b=1)
            wide[:, :inner], wide[:, inner:] = own, right
            factored = wide.reshape(some, size, -1, size)
            for i in range(some):
                rows[i] = factored[i, :, i : i + width]
            product = (right.T @ right).reshape(width - 1, size, width - 1, size)
            for i, below in enumerate(panels[low + some : low + some + width - 1]):
                below[:, : width - 1 - i] -= product[i, :, i:]
        return cls(panels)

    def half_solve_in_place(
        self, right: Float[np.ndarray, "rows size columns"]
    ) -> Float[np.ndarray, "rows size columns"]:
        """U⁻ᵀ right, in its place: columns whose inner products are those of the inverse matrix."""
        count, size, width, _ = self.panels.shape
        for a in range(count):
            dtrsm(
                1.0, self.panels[a, :, 0].T.copy("F"), right[a].T, side=1, lower=1, trans_a=1, overwrite_b=1
            )
            below = right[a + 1 : a + width]
            blocks = self.panels[a, :, 1 : 1 + len(below)].reshape(size, -1)
            below -= (blocks.T @ right[a]).reshape(below.shape)
        return right

    def back_solve(self, y: Float[np.ndarray, "rows size columns"]) -> Float[np.ndarray, "rows size columns"]:
        """U⁻¹ y."""
        count, size, width, _ = self.panels.shape
        x = y.copy()
        for a in range(count - 1, -1, -1):
            below = x[a + 1 : a + width]
            blocks = self.panels[a, :, 1 : 1 + len(below)].reshape(size, -1)
            x[a] -= blocks @ below.reshape(-1, x.shape[2])
            dtrsm(1.0, self.panels[a, :, 0].T.copy("F"), x[a].T, side=1, lower=1, overwrite_b=1)
        return x


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
