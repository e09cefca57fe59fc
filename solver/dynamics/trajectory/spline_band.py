"""The Gauss-Newton matrix of a spline's coefficients: a band in time, filled from per-frame terms.

Block (a, b) couples the coefficients c_a and c_b of all dofs. A frame's terms touch six neighbouring
coefficients, those between a frame and its predecessor seven, so blocks farther apart than six are zero.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import as_strided
from scipy.sparse import csr_matrix

from solver.common.true_runs import runs
from solver.dynamics.trajectory.block_tridiagonal import BandCholesky, BlockTridiagonal
from solver.dynamics.trajectory.spline_basis import ORDER, SplineBasis

REACH = ORDER  # largest distance of coupled coefficients
SMALLEST = 1e-9  # added to the diagonal: a coefficient that nothing touches stays where it is
CHUNK = 8  # pieces worked on together: what is made of them stays in the processor's cache


@dataclass(frozen=True, eq=False)
class CoefficientBand:
    """Upper band: `panels[a, :, k]` is block (a, a + k).

    What is added may be of fewer columns than the spline has: it is of the first ones.
    """

    basis: SplineBasis
    panels: Float[np.ndarray, "coefficients columns seven columns"]

    @classmethod
    def empty(cls, basis: SplineBasis, columns: int) -> "CoefficientBand":
        """All zero."""
        return cls(basis, np.zeros((basis.coefficients, columns, REACH + 1, columns)))

    @staticmethod
    def gather(
        basis: SplineBasis, per_frame: Float[np.ndarray, "frames dofs"], order: int
    ) -> Float[np.ndarray, "coefficients dofs"]:
        """Σ_t B_a^(order)(t) x_t: a gradient by frames as one by coefficients."""
        rows = (basis.first[:, None] + np.arange(ORDER)).ravel()
        frames = np.repeat(np.arange(basis.frames), ORDER)
        weights = csr_matrix(
            (basis.derivative[order].ravel(), (rows, frames)), shape=(basis.coefficients, basis.frames)
        )
        return weights @ per_frame

    def add_frames(
        self,
        first: int,
        H: Float[np.ndarray, "some dofs dofs"],
        H_before: Float[np.ndarray, "some dofs dofs"] | None = None,
        factor: float = 1.0,
    ) -> None:
        """Terms of some frames: of each alone, and of each with the one before it.

        Args:
            first: of these frames, the first one of a piece; the last one is a piece's or the trial's.
            H: at (q_t, q_t), symmetric.
            H_before: at (q_t, q_(t−1)), and its transpose; zero on frame 0. None: no such terms.
            factor: of all.
        """
        spacing = self.basis.spacing
        for low in range(0, len(H), CHUNK * spacing):
            high = low + CHUNK * spacing
            if len(H) - high < spacing:  # one more at the trial's end
                high = len(H)
            before = None if H_before is None else H_before[low:high]
            self._add_frames(first + low, H[low:high], before, factor)
            if high == len(H):
                break

    def _add_frames(
        self,
        first: int,
        H: Float[np.ndarray, "some dofs dofs"],
        H_before: Float[np.ndarray, "some dofs dofs"] | None,
        factor: float,
    ) -> None:
        """Block (a, a + k) sums over the frames near coefficient a: one matrix product for all k."""
        spacing, dofs = self.basis.spacing, H.shape[1]
        piece, last = self.basis.first[[first, first + len(H) - 1]]
        touched = np.arange(max(0, piece - 1), last + ORDER)
        begin = touched[0] - ORDER + 1  # piece with which the first of these coefficients' windows begins
        padded = np.zeros(((len(touched) + REACH) * spacing, 3, dofs, dofs))
        own = padded[first - begin * spacing :][: len(H)]
        own[:, 0] = H
        if H_before is not None:
            own[:, 1], own[:, 2] = H_before, H_before.transpose(0, 2, 1)
        row = padded.strides[1]
        windows = as_strided(
            padded,
            (len(touched), (REACH + 1) * spacing * 3, dofs * dofs),
            (3 * spacing * row, row, padded.itemsize),
            writeable=False,
        )
        product = (factor * self._window_weights[touched]) @ windows
        panels = product.reshape(len(touched), REACH + 1, dofs, dofs)
        self.panels[touched[0] : touched[-1] + 1, :dofs, :, :dofs] += panels.transpose(0, 2, 1, 3)

    @cached_property
    def _window_weights(self) -> Float[np.ndarray, "coefficients seven window"]:
        """What block (a, a + k) takes of H_t, H_before_t and its transpose, of frames near coefficient a.

        These begin with the first frame of piece a − 5 and end with piece a + 1, whose first frame's
        predecessor coefficient a still touches.
        """
        basis = self.basis
        weights = np.zeros((basis.coefficients, REACH + 1, (REACH + 1) * basis.spacing, 3))
        B, t = basis.derivative[0], np.arange(basis.frames)
        for a in range(ORDER):
            c = basis.first + a
            window = t - basis.spacing * (c - ORDER + 1)
            for k in range(ORDER - a):
                weights[c, k, window, 0] = B[:, a] * B[:, a + k]
        before = basis.first[:-1]  # the pair's coefficients, seven at most, are counted from it
        later = np.zeros((basis.frames - 1, ORDER + 1))
        later[(t[:-1, None]), (basis.first[1:] - before)[:, None] + np.arange(ORDER)] = B[1:]
        earlier = np.pad(B[:-1], ((0, 0), (0, 1)))
        for a in range(ORDER + 1):
            for k in range(ORDER + 1 - a):
                forward, backward = later[:, a] * earlier[:, a + k], earlier[:, a] * later[:, a + k]
                exists = np.flatnonzero((forward != 0) | (backward != 0))
                c = before[exists] + a
                window = exists + 1 - basis.spacing * (c - ORDER + 1)
                weights[c, k, window, 1], weights[c, k, window, 2] = forward[exists], backward[exists]
        return weights.reshape(basis.coefficients, REACH + 1, -1)

    def add_residual_rows(
        self,
        first: int,
        jacobians: Sequence[Float[np.ndarray, "some 6 dofs"]],
        beside: Float[np.ndarray, "some 6 columns"],
        products: Float[np.ndarray, "coefficients dofs columns"],
        factor: float = 1.0,
    ) -> None:
        """Rows R of some frames by the coefficients: adds RᵀR here, and to `products` RᵀY.

        Args:
            first: of these frames, the first one of a piece; the last one is a piece's or the trial's.
            jacobians: the rows' derivatives by q, q̇ and q̈.
            beside: Y, what stands beside the rows: derivatives by other parameters, residuals.
            products: to be added to.
            factor: of all.
        """
        dofs = jacobians[0].shape[2]
        for pieces, rows, right in self._rows_by_piece(first, jacobians, beside, np.sqrt(factor)):
            some = pieces.stop - pieces.start
            for a in range(ORDER):
                own = rows[:, :, a * dofs : (a + 1) * dofs].transpose(0, 2, 1)
                at = slice(pieces.start + a, pieces.stop + a)
                product = (own @ rows[:, :, a * dofs :]).reshape(some, dofs, ORDER - a, dofs)
                self.panels[at, :dofs, : ORDER - a, :dofs] += product
                products[at, :dofs] += own @ right

    def add_values(self, weight: Float[np.ndarray, " some"]) -> None:
        """weight_j Σ_t q_tj², of the first columns."""
        self._add_diagonal(self.basis.value_gram, weight)

    def add_jerk(self, weight: Float[np.ndarray, " some"]) -> None:
        """weight_j ∫ (d³q_j/dt³)² dt, of the first columns."""
        self._add_diagonal(self.basis.jerk_gram, weight)

    def _add_diagonal(
        self, gram: Float[np.ndarray, "coefficients 6"], weight: Float[np.ndarray, " some"]
    ) -> None:
        columns = np.arange(len(weight))
        for k in range(ORDER):
            self.panels[:, columns, k, columns] += gram[:, k, None] * weight

    def factorized_in_place(self, damping: float = 0.0) -> BandCholesky:
        """The matrix's factor, in its own place: the matrix is gone.

        Args:
            damping: share of itself by which the diagonal is enlarged (Marquardt).

        Raises:
            numpy.linalg.LinAlgError: the matrix is not positive definite.
        """
        own = np.arange(self.panels.shape[1])
        self.panels[:, own, 0, own] *= 1 + damping
        self.panels[:, own, 0, own] += SMALLEST
        return BandCholesky.in_place(self.panels)

    def block_tridiagonal(self) -> BlockTridiagonal:
        """The same matrix in blocks of six coefficients, the last one padded with the identity."""
        count, dofs = self.panels.shape[:2]
        groups = -(-count // REACH)
        diagonal = np.zeros((groups, REACH, dofs, REACH, dofs))
        below = np.zeros((groups, REACH, dofs, REACH, dofs))
        for a in range(REACH):
            rows = self.panels[a::REACH]
            some = slice(0, rows.shape[0])
            diagonal[some, a, :, a:] = rows[:, :, : REACH - a]
            for b in range(a + 1, REACH):
                diagonal[some, b, :, a] = rows[:, :, b - a].transpose(0, 2, 1)
            for b in range(a + 1):
                below[some, b, :, a] = rows[:, :, REACH + b - a].transpose(0, 2, 1)
        size = REACH * dofs
        matrix = BlockTridiagonal(diagonal.reshape(groups, size, size), below.reshape(groups, size, size))
        own = np.arange(size)
        matrix.diagonal[:, own, own] += SMALLEST
        padding = own[(count - (groups - 1) * REACH) * dofs :]
        matrix.diagonal[-1, padding, padding] = 1.0
        return matrix

    def _rows_by_piece(
        self,
        first: int,
        jacobians: Sequence[Float[np.ndarray, "some 6 dofs"]],
        beside: Float[np.ndarray, "some 6 columns"],
        factor: float,
    ) -> Iterator[
        tuple[slice, Float[np.ndarray, "pieces rows local"], Float[np.ndarray, "pieces rows columns"]]
    ]:
        """Rows by the six coefficients of each piece, and what stands beside them; in chunks of pieces.

        A piece's frames lie below one another; where it has fewer than the others, zeros do. Pieces all of
        whose rows are zero are left out.
        """
        basis, dofs, columns = self.basis, jacobians[0].shape[2], beside.shape[2]
        piece = basis.first[first : first + len(beside)]
        within = np.arange(first, first + len(beside)) - basis.spacing * piece
        most = int(within.max()) + 1
        is_zero = np.ones(piece[-1] + 1, dtype=bool)
        is_zero[piece[np.any([J.any(axis=(1, 2)) for J in jacobians], axis=0)]] = False
        for low, high in (
            (low, min(end, low + CHUNK)) for start, end in runs(~is_zero) for low in range(start, end, CHUNK)
        ):
            some = slice(*np.searchsorted(piece, (low, high)))
            count = some.stop - some.start
            rows = np.zeros((high - low, most, 6, ORDER * dofs))
            right = np.zeros((high - low, most, 6, columns))
            at = piece[some] - low, within[some]
            rows[at] = sum(
                (factor * basis.derivative[order][first:][some, None, :, None] * J[some, :, None, :]).reshape(
                    count, 6, -1
                )
                for order, J in enumerate(jacobians)
            )
            right[at] = factor * beside[some]
            yield (
                slice(low, high),
                rows.reshape(high - low, most * 6, -1),
                right.reshape(high - low, most * 6, -1),
            )


def in_blocks(x: Float[np.ndarray, "coefficients dofs columns"]) -> Float[np.ndarray, "blocks size columns"]:
    """Columns over coefficients, grouped and padded as the block-tridiagonal matrix is."""
    count, dofs, columns = x.shape
    groups = -(-count // REACH)
    padded = np.zeros((groups * REACH, dofs, columns))
    padded[:count] = x
    return padded.reshape(groups, REACH * dofs, columns)


def from_blocks(
    x: Float[np.ndarray, "blocks size *columns"], coefficients: int, dofs: int
) -> Float[np.ndarray, "coefficients dofs *columns"]:
    """The way back from `in_blocks`."""
    return x.reshape(-1, dofs, *x.shape[2:])[:coefficients]


def nearest_spline(
    basis: SplineBasis, q: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "coefficients dofs"]:
    """Coefficients of the spline that lies nearest to a motion (least squares)."""
    band = CoefficientBand.empty(basis, 1)
    band.add_frames(0, np.ones((basis.frames, 1, 1)))
    band.add_jerk(np.array([1e-9]))
    factor = band.block_tridiagonal().factorized_in_place()
    half = factor.half_solve(in_blocks(CoefficientBand.gather(basis, q, 0)[:, None, :]))
    return from_blocks(factor.back_solve(half), basis.coefficients, 1)[:, 0]
