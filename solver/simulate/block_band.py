"""Normal equations of a spline fit: a symmetric matrix of blocks, banded in time."""

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_triangular

from solver.simulate.spline_motion import ACTIVE


class BlockBand:
    """JᵀJ and Jᵀr of residuals r that depend on the active coefficients of their time only.

    `blocks[k, d]` couples coefficient k + d (rows) with coefficient k (columns).
    """

    def __init__(self, coefficients: int, dofs: int) -> None:
        self.blocks = np.zeros((coefficients, ACTIVE, dofs, dofs))
        self.gradient = np.zeros((coefficients, dofs))

    def add_diagonal(
        self,
        first: Int[np.ndarray, " times"],
        basis: Float[np.ndarray, "times active"],
        residual: Float[np.ndarray, "times dofs"],
        slope: Float[np.ndarray, " dofs"],
    ) -> None:
        """Residuals that depend each on its own dof.

        Args:
            first: index of the first active coefficient.
            basis: weights of the active ones.
            residual: of each time and dof.
            slope: its derivative by that dof.
        """
        count, dofs = self.gradient.shape
        diagonal = np.arange(dofs)
        for later in range(ACTIVE):
            np.add.at(self.gradient, first + later, basis[:, later, None] * residual * slope)
            for earlier in range(later + 1):
                products = np.bincount(first + earlier, basis[:, later] * basis[:, earlier], count)
                self.blocks[:, later - earlier, diagonal, diagonal] += products[:, None] * slope**2

    def add_rows(
        self,
        first: Int[np.ndarray, " times"],
        rows: Float[np.ndarray, "times residuals active dofs"],
        residual: Float[np.ndarray, "times residuals"],
    ) -> None:
        """Residuals that depend on several dofs; `first` must not decrease."""
        dofs = self.gradient.shape[1]
        starts = np.flatnonzero(np.diff(first, prepend=-1))
        for since, until in zip(starts, [*starts[1:], len(first)], strict=True):
            k = first[since]
            flat = rows[since:until].reshape(-1, ACTIVE * dofs)
            flat = flat[np.any(flat, axis=1)]
            square = (flat.T @ flat).reshape(ACTIVE, dofs, ACTIVE, dofs)
            for later in range(ACTIVE):
                for earlier in range(later + 1):
                    self.blocks[k + earlier, later - earlier] += square[later, :, earlier]
            self.gradient[k : k + ACTIVE] += np.einsum(
                "tmkd,tm->kd", rows[since:until], residual[since:until], optimize=True
            )

    def factor(self) -> "BandFactor":
        """Cholesky factor of JᵀJ."""
        count, bands, dofs, _ = self.blocks.shape
        lower = np.zeros((bands * dofs, count * dofs))  # LAPACK: element (i, j) stands in row i − j, column j
        for d in range(bands):
            for i in range(dofs):
                for j in range(dofs):
                    if d * dofs + i >= j:
                        lower[d * dofs + i - j, j::dofs] = self.blocks[:, d, i, j]
        return BandFactor(cholesky_banded(lower, lower=True, overwrite_ab=True, check_finite=False))


class BandFactor:
    """A factorized JᵀJ."""

    def __init__(self, factor: Float[np.ndarray, "bands unknowns"]) -> None:
        self._factor = factor

    def solve(self, right: Float[np.ndarray, "unknowns *columns"]) -> Float[np.ndarray, "unknowns *columns"]:
        """(JᵀJ)⁻¹ times a vector or several."""
        return cho_solve_banded((self._factor, True), right, check_finite=False)

    def onto_constraints(
        self,
        step: Float[np.ndarray, " unknowns"],
        first: Int[np.ndarray, " times"],
        rows: Float[np.ndarray, "times constraints active dofs"],
        violated: Float[np.ndarray, "times constraints"],
    ) -> Float[np.ndarray, " unknowns"]:
        """The step nearest to a given one, in the metric of JᵀJ, that meets C step = −violated."""
        times, each, _, dofs = rows.shape
        spread = np.zeros((times * each, len(step)))
        for t in range(times):
            span = slice(first[t] * dofs, (first[t] + ACTIVE) * dofs)
            spread[t * each : (t + 1) * each, span] = rows[t].reshape(each, -1)
        half = self._through_lower(spread.T, np.repeat(first * dofs, each))
        missing = violated.ravel() + spread @ step
        multipliers = np.linalg.lstsq(half.T @ half, missing, rcond=1e-14)[0]
        return step - self.solve(spread.T @ multipliers)

    def _through_lower(
        self, right: Float[np.ndarray, "unknowns columns"], begins: Int[np.ndarray, " columns"]
    ) -> Float[np.ndarray, "unknowns columns"]:
        """L⁻¹ times columns that are zero before `begins`, which must not decrease.

        By square blocks of the band's width, of which L has two in a row: LAPACK's solver for bands takes one
        column at a time, which is several times slower for hundreds of them.
        """
        width, unknowns = self._factor.shape
        answer = np.array(right, order="F")
        for start in range(0, unknowns, width):
            end = min(start + width, unknowns)
            begun = int(np.searchsorted(begins, end))
            if start:
                before = self._block(start, end, start - width)
                answer[start:end, :begun] -= before @ answer[start - width : start, :begun]
            own = self._block(start, end, start)
            answer[start:end, :begun] = solve_triangular(
                own, answer[start:end, :begun], lower=True, check_finite=False
            )
        return answer

    def _block(self, start: int, end: int, column: int) -> Float[np.ndarray, "rows columns"]:
        """Rows `start` to `end` of L and as many columns as the band is wide, from `column` on."""
        width, unknowns = self._factor.shape
        below = np.arange(start, end)[:, None]
        right = np.arange(column, min(column + width, unknowns))
        diagonal = below - right
        inside = (diagonal >= 0) & (diagonal < width)
        return np.where(inside, self._factor[np.clip(diagonal, 0, width - 1), right], 0.0)
