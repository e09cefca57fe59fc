"""The Gauss-Newton matrix of a spline's coefficients: a band in time, filled from per-frame terms.

Block (a, b) couples the coefficients c_a and c_b of all dofs. A frame's terms touch six neighbouring
coefficients, those between a frame and its predecessor seven, so blocks farther apart than six are zero.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_matrix

from solver.dynamics.block_tridiagonal import BlockTridiagonal
from solver.dynamics.spline_basis import ORDER, SplineBasis

REACH = ORDER  # largest distance of coupled coefficients
SMALLEST = 1e-9  # added to the diagonal: a coefficient that nothing touches stays where it is
CHUNK = 64  # pieces worked on together


@dataclass(frozen=True, eq=False)
class CoefficientBand:
    """Upper band: `blocks[k][a]` is block (a, a + k)."""

    basis: SplineBasis
    blocks: Float[np.ndarray, "seven coefficients dofs dofs"]

    @classmethod
    def empty(cls, basis: SplineBasis, dofs: int) -> "CoefficientBand":
        """All zero."""
        return cls(basis, np.zeros((REACH + 1, basis.coefficients, dofs, dofs)))

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

    def add_same_frame(self, H: Float[np.ndarray, "frames dofs dofs"], factor: float = 1.0) -> None:
        """Terms of q_t alone: H_t at (q_t, q_t), symmetric, times a factor."""
        flat = H.reshape(len(H), -1)
        for k, weights in enumerate(_same_frame_weights(self.basis)):
            self.blocks[k] += ((factor * weights) @ flat).reshape(self.blocks[k].shape)

    def add_neighbour_frames(self, X: Float[np.ndarray, "pairs dofs dofs"], factor: float = 1.0) -> None:
        """Terms between frames: X_i at (q_(i+1), q_i) and its transpose, times a factor."""
        flat = X.reshape(len(X), -1)
        for k, (later_first, earlier_first) in enumerate(_neighbour_weights(self.basis)):
            self.blocks[k] += ((factor * later_first) @ flat).reshape(self.blocks[k].shape)
            turned = ((factor * earlier_first) @ flat).reshape(self.blocks[k].shape)
            self.blocks[k] += turned.transpose(0, 2, 1)

    def add_residual_rows(
        self, value: Float[np.ndarray, "frames 6"], jacobians: list[Float[np.ndarray, "frames 6 dofs"]]
    ) -> Float[np.ndarray, "coefficients dofs"]:
        """Rows r with derivatives by q, q̇, q̈; adds RᵀR and returns the gradient Rᵀr."""
        gradient = np.zeros(self.blocks.shape[1:3])
        for order, J in enumerate(jacobians):
            gradient += self.gather(self.basis, np.einsum("tij,ti->tj", J, value), order)
        dofs = self.blocks.shape[2]
        for pieces, rows in self._rows_by_piece(jacobians):
            product = (rows.transpose(0, 2, 1) @ rows).reshape(len(rows), ORDER, dofs, ORDER, dofs)
            for a in range(ORDER):
                for b in range(a, ORDER):
                    at = slice(pieces.start + a, pieces.stop + a)
                    self.blocks[b - a, at] += product[:, a, :, b, :]
        return gradient

    def coupling(
        self,
        jacobians: list[Float[np.ndarray, "frames 6 dofs"]],
        by_phi: Float[np.ndarray, "frames 6 parameters"],
    ) -> Float[np.ndarray, "coefficients dofs parameters"]:
        """RᵀY: the border of parameters whose derivatives of the same rows are Y."""
        parameters, dofs = by_phi.shape[2], self.blocks.shape[2]
        border = np.zeros((self.basis.coefficients, dofs, parameters))
        if not parameters:
            return border
        for order, J in enumerate(jacobians):
            product = (J.transpose(0, 2, 1) @ by_phi).reshape(len(J), -1)
            border += self.gather(self.basis, product, order).reshape(border.shape)
        return border

    def add_jerk(self, weight: Float[np.ndarray, " dofs"]) -> None:
        """weight_j ∫ (d³q_j/dt³)² dt."""
        dofs = np.arange(self.blocks.shape[2])
        for k in range(ORDER):
            self.blocks[k][:, dofs, dofs] += self.basis.jerk_gram[:, k, None] * weight

    def block_tridiagonal(self, damping: float = 0.0) -> BlockTridiagonal:
        """The same matrix in blocks of six coefficients, the last one padded with the identity.

        Args:
            damping: share of itself by which the diagonal is enlarged (Marquardt).
        """
        count, dofs = self.basis.coefficients, self.blocks.shape[2]
        groups = -(-count // REACH)
        diagonal = np.zeros((groups, REACH, dofs, REACH, dofs))
        below = np.zeros((groups, REACH, dofs, REACH, dofs))
        for a in range(REACH):
            rows = self.blocks[:, a::REACH]
            some = slice(0, rows.shape[1])
            for b in range(a, REACH):
                diagonal[some, a, :, b, :] = rows[b - a]
                diagonal[some, b, :, a, :] = rows[b - a].transpose(0, 2, 1)
            for b in range(a + 1):
                below[some, b, :, a, :] = rows[REACH + b - a].transpose(0, 2, 1)
        size = REACH * dofs
        matrix = BlockTridiagonal(diagonal.reshape(groups, size, size), below.reshape(groups, size, size))
        own = np.arange(size)
        matrix.diagonal[:, own, own] *= 1 + damping
        matrix.diagonal[:, own, own] += SMALLEST
        padding = own[(count - (groups - 1) * REACH) * dofs :]
        matrix.diagonal[-1, padding, padding] = 1.0
        return matrix

    def in_blocks(
        self, x: Float[np.ndarray, "coefficients dofs columns"]
    ) -> Float[np.ndarray, "blocks size columns"]:
        """Columns over coefficients, grouped and padded as the block-tridiagonal matrix is."""
        count, dofs, columns = x.shape
        groups = -(-count // REACH)
        padded = np.zeros((groups * REACH, dofs, columns))
        padded[:count] = x
        return padded.reshape(groups, REACH * dofs, columns)

    def from_blocks(
        self, x: Float[np.ndarray, "blocks size *columns"]
    ) -> Float[np.ndarray, "coefficients dofs *columns"]:
        """The way back from `in_blocks`."""
        dofs = self.blocks.shape[2]
        return x.reshape(-1, dofs, *x.shape[2:])[: self.basis.coefficients]

    def _rows_by_piece(self, jacobians: list[Float[np.ndarray, "frames 6 dofs"]]):  # type: ignore[no-untyped-def]
        """Rows by the six coefficients of each piece, its frames below one another; in chunks of pieces."""
        basis = self.basis
        dofs = jacobians[0].shape[2]
        pieces = basis.coefficients - ORDER + 1
        starts = np.searchsorted(basis.first, np.arange(pieces + 1))
        most = int(np.diff(starts).max())
        for low in range(0, pieces, CHUNK):
            high = min(pieces, low + CHUNK)
            frames = slice(starts[low], starts[high])
            local = sum(
                basis.derivative[order][frames, None, :, None] * J[frames, :, None, :]
                for order, J in enumerate(jacobians)
            )
            rows = np.zeros((high - low, most, 6, ORDER * dofs))
            piece = basis.first[frames] - low
            within = np.arange(starts[low], starts[high]) - starts[basis.first[frames]]
            rows[piece, within] = local.reshape(len(piece), 6, -1)
            yield slice(low, high), rows.reshape(high - low, most * 6, -1)


def nearest_spline(
    basis: SplineBasis, q: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "coefficients dofs"]:
    """Coefficients of the spline that lies nearest to a motion (least squares)."""
    band = CoefficientBand.empty(basis, 1)
    band.add_same_frame(np.ones((basis.frames, 1, 1)))
    band.add_jerk(np.array([1e-9]))
    factor = band.block_tridiagonal().factorized_in_place()
    half = factor.half_solve(band.in_blocks(CoefficientBand.gather(basis, q, 0)[:, None, :]))
    return band.from_blocks(factor.back_solve(half))[:, 0, :]


def _same_frame_weights(basis: SplineBasis) -> list[csr_matrix]:
    """For each distance k: B_a(t) B_(a+k)(t), coefficient a by frame t."""
    B, frames = basis.derivative[0], np.arange(basis.frames)
    weights = []
    for k in range(ORDER):
        a = np.arange(ORDER - k)
        rows = (basis.first[:, None] + a).ravel()
        values = (B[:, a] * B[:, a + k]).ravel()
        columns = np.repeat(frames, len(a))
        weights.append(csr_matrix((values, (rows, columns)), shape=(basis.coefficients, basis.frames)))
    return weights


def _neighbour_weights(basis: SplineBasis) -> list[tuple[csr_matrix, csr_matrix]]:
    """For each distance k: weights of pairs whose later frame's coefficient comes first; of the others."""
    B, pairs = basis.derivative[0], np.arange(basis.frames - 1)
    values = B[1:, :, None] * B[:-1, None, :]
    local = np.arange(ORDER)
    later = np.broadcast_to(basis.first[1:, None, None] + local[:, None], values.shape)
    earlier = np.broadcast_to(basis.first[:-1, None, None] + local, values.shape)
    pair = np.broadcast_to(pairs[:, None, None], values.shape)
    shape = (basis.coefficients, len(pairs))
    weights = []
    for k in range(REACH + 1):
        first_later, first_earlier = earlier - later == k, later - earlier == k
        weights.append(
            (
                csr_matrix((values[first_later], (later[first_later], pair[first_later])), shape=shape),
                csr_matrix(
                    (values[first_earlier], (earlier[first_earlier], pair[first_earlier])), shape=shape
                ),
            )
        )
    return weights
