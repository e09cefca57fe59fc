"""Quintic B-splines through a trial: what each frame's q, q̇ and q̈ take of the coefficients."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import BSpline

from solver.common.frames_at_once import by_frames

DEGREE = 5
ORDER = DEGREE + 1  # coefficients that act on one instant
JERK = 3  # order of the derivative


@dataclass(frozen=True)
class SplineBasis:
    """q(t) = Σ_a B_a(t) c_a on equally spaced knots that reach beyond both ends of the trial.

    On frame t the coefficients first[t] … first[t] + 5 act, with the weights `derivative[k][t]` on the k-th
    derivative.
    """

    frames: int
    rate: float  # [Hz]
    spacing: int  # frames between knots
    coefficients: int
    first: Int[np.ndarray, " frames"]
    derivative: tuple[Float[np.ndarray, "frames 6"], ...]  # orders 0, 1, 2 [1, 1/s, 1/s²]
    jerk_gram: Float[np.ndarray, "coefficients 6"]  # ∫B'''_a B'''_(a+k) dt over the trial, k = 0 … 5 [1/s⁵]

    @cached_property
    def value_gram(self) -> Float[np.ndarray, "coefficients 6"]:
        """Σ_t B_a(t) B_(a+k)(t) over the frames, k = 0 … 5."""
        gram, B = np.zeros((self.coefficients, ORDER)), self.derivative[0]
        for a in range(ORDER):
            for k in range(ORDER - a):
                at, products = self.first + a, B[:, a] * B[:, a + k]
                gram[:, k] += np.bincount(at, products, minlength=self.coefficients)
        return gram

    def evaluate(
        self, coefficients: Float[np.ndarray, "coefficients dofs"], order: int = 0
    ) -> Float[np.ndarray, "frames dofs"]:
        """The spline's derivative of that order (0, 1 or 2) at the frames."""

        def at(
            first: Int[np.ndarray, " some"], weights: Float[np.ndarray, "some 6"]
        ) -> Float[np.ndarray, "some dofs"]:
            return np.einsum("ta,tad->td", weights, coefficients[first[:, None] + np.arange(ORDER)])

        return by_frames(at, self.first, self.derivative[order])

    def jerk(
        self, coefficients: Float[np.ndarray, "coefficients dofs"]
    ) -> Float[np.ndarray, "pieces dofs 3"]:
        """d³q/dt³ at three instants of each piece; its squares sum up to ∫ (d³q/dt³)² dt.

        From differences of neighbours: by the Gram matrix, a sum of large numbers would leave a small one.
        """
        third = sliding_window_view(np.diff(coefficients, JERK, axis=0), 3, axis=0)
        return third @ (_JERK_AT_NODES.T * (self.spacing / self.rate) ** (0.5 - JERK))

    def jerk_product(
        self, coefficients: Float[np.ndarray, "coefficients dofs"]
    ) -> Float[np.ndarray, "coefficients dofs"]:
        """Half the gradient of ∫ (d³q/dt³)² dt by the coefficients, dof by dof."""
        by_third = self.jerk(coefficients) @ (_JERK_AT_NODES * (self.spacing / self.rate) ** (0.5 - JERK))
        padded = np.zeros((self.coefficients + JERK, coefficients.shape[1]))
        for a in range(3):
            padded[JERK + a : JERK + a + len(by_third)] += by_third[:, :, a]
        return -np.diff(padded, JERK, axis=0)


def spline_basis(frames: int, rate: float, spacing: int) -> SplineBasis:
    """The basis for a trial.

    Args:
        frames: of the trial, at least 2.
        rate: [Hz].
        spacing: frames from knot to knot.
    """
    pieces = max(1, -(-(frames - 1) // spacing))
    count = pieces + DEGREE
    piece = np.minimum(np.arange(frames) // spacing, pieces - 1)
    within = np.arange(frames) / spacing - piece
    width = spacing / rate
    derivative = tuple(_weights(within, order) / width**order for order in range(3))
    return SplineBasis(frames, rate, spacing, count, piece, derivative, _jerk_gram(pieces, width))


def spline_at(
    coefficients: Float[np.ndarray, "coefficients dofs"],
    width_s: float,
    seconds: Float[np.ndarray, " times"],
    order: int = 0,
) -> Float[np.ndarray, "times dofs"]:
    """The derivative of that order of Σ_a B_a(t) c_a, at any times within the trial.

    Args:
        coefficients: of a basis of `spline_basis`.
        width_s: between knots [s].
        seconds: since the first frame [s].
        order: 0 for the spline itself.
    """
    knots = (np.arange(len(coefficients) + ORDER) - DEGREE) * width_s
    return BSpline(knots, coefficients, DEGREE)(seconds, nu=order)


def _weights(within: Float[np.ndarray, " some"], order: int) -> Float[np.ndarray, "some 6"]:
    """Derivatives by the piece's own coordinate (0 to 1) of the six splines that live on a piece."""
    knots = np.arange(-DEGREE, ORDER + 1, dtype=float)
    columns = []
    for a in range(ORDER):
        unit = np.zeros(len(knots) - ORDER)
        unit[a] = 1.0
        columns.append(BSpline(knots, unit, DEGREE)(within, nu=order))
    return np.stack(columns, axis=1)


def _jerk_at_nodes() -> Float[np.ndarray, "nodes 3"]:
    """A piece's third derivative, a parabola by three third differences, at Gauss's nodes and weighed."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    u = (nodes + 1) / 2
    parabolas = np.stack([(1 - u) ** 2 / 2, (1 + 2 * u - 2 * u**2) / 2, u**2 / 2], axis=1)
    return np.sqrt(weights / 2)[:, None] * parabolas


_JERK_AT_NODES = _jerk_at_nodes()


def _jerk_gram(pieces: int, width: float) -> Float[np.ndarray, "coefficients 6"]:
    """Exact by Gauss's rule: on a piece the third derivative is a parabola."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    third = _weights((nodes + 1) / 2, 3)
    piece = np.einsum("g,ga,gb->ab", weights / 2, third, third) / width**5
    gram = np.zeros((pieces + DEGREE, ORDER))
    for a in range(ORDER):
        for b in range(a, ORDER):
            gram[a : a + pieces, b - a] += piece[a, b]
    return gram
