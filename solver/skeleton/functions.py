"""Scalar functions of one coordinate, as OpenSim models use them, with two derivatives."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_banded

Values = Float[np.ndarray, "..."]


class ScalarFunction(Protocol):
    """x ↦ f(x), f'(x), f''(x), element by element."""

    def __call__(self, x: Values) -> tuple[Values, Values, Values]: ...


@dataclass(frozen=True)
class Constant:
    """f(x) = value."""

    value: float

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        zero = np.zeros_like(x)
        return zero + self.value, zero, zero


@dataclass(frozen=True)
class Linear:
    """f(x) = slope · x + intercept."""

    slope: float
    intercept: float

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        zero = np.zeros_like(x)
        return self.slope * x + self.intercept, zero + self.slope, zero


@dataclass(frozen=True)
class Polynomial:
    """Coefficients from the highest power down."""

    coefficients: tuple[float, ...]

    @cached_property
    def _derivatives(self) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        return np.polyder(np.array(self.coefficients)), np.polyder(np.array(self.coefficients), 2)

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        first, second = self._derivatives
        return np.polyval(self.coefficients, x), np.polyval(first, x), np.polyval(second, x)


@dataclass(frozen=True)
class PiecewiseLinear:
    """Straight lines between knots; the end pieces extend beyond the knots."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative (zero between knots)."""
        knots, heights = np.array(self.x), np.array(self.y)
        piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
        slope = np.diff(heights)[piece] / np.diff(knots)[piece]
        return heights[piece] + slope * (x - knots[piece]), slope, np.zeros_like(x)


@dataclass(frozen=True)
class CubicSpline:
    """Piecewise cubic through knots, linear beyond them (OpenSim's SimmSpline).

    The ends follow SIMM: the third derivative of the first (last) piece equals that of the cubic through the
    first (last) four knots. Three knots give a parabola, two a straight line.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]

    @cached_property
    def _alone(self) -> "CubicTable":
        return CubicTable([self])

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        value, slope, curvature = self._alone(np.reshape(x, (-1, 1)))
        return value.reshape(np.shape(x)), slope.reshape(np.shape(x)), curvature.reshape(np.shape(x))


@dataclass(frozen=True)
class Scaled:
    """f(x) = factor · inner(x) (OpenSim's MultiplierFunction)."""

    factor: float
    inner: ScalarFunction

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        value, slope, curvature = self.inner(x)
        return self.factor * value, self.factor * slope, self.factor * curvature


@dataclass(frozen=True)
class Composed:
    """f(x) = outer(inner(x)): an axis driven by a coordinate that is itself coupled to another."""

    outer: ScalarFunction
    inner: ScalarFunction

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative by the chain rule."""
        u, du, ddu = self.inner(x)
        value, slope, curvature = self.outer(u)
        return value, slope * du, curvature * du**2 + slope * ddu


def multiply_function(function: ScalarFunction, factor: float) -> ScalarFunction:
    """The function `factor` times as large; constants and multiples stay single."""
    if factor == 1.0:
        return function
    if isinstance(function, Constant):
        return Constant(factor * function.value)
    if isinstance(function, Scaled):
        return Scaled(factor * function.factor, function.inner)
    return Scaled(factor, function)


def simplified(function: ScalarFunction) -> ScalarFunction:
    """The same function without what leaves it as it is, as one where two are one."""
    match function:
        case Composed(outer, Linear(1.0, 0.0)):
            return simplified(outer)
        case Composed(Linear(slope, intercept), Linear(inner_slope, inner_intercept)):
            return Linear(slope * inner_slope, slope * inner_intercept + intercept)
        case Scaled(factor, CubicSpline(x, y)):
            return CubicSpline(x, tuple(factor * height for height in y))
    return function


class CubicTable:
    """Many cubic splines at once, each of its own argument."""

    def __init__(self, splines: Sequence[CubicSpline]) -> None:
        """Lay out the pieces of all in one table."""
        pieces = [_pieces(spline.x, spline.y) for spline in splines]
        most = max((len(own) for own in pieces), default=1)
        self._table = np.full((len(splines), most, 5), np.inf)
        for row, own in zip(self._table, pieces, strict=True):
            row[: len(own)] = own
        self._first = np.array([spline.x[0] for spline in splines])
        self._last = np.array([spline.x[-1] for spline in splines])

    def __call__(
        self, x: Float[np.ndarray, "points splines"]
    ) -> tuple[
        Float[np.ndarray, "points splines"],
        Float[np.ndarray, "points splines"],
        Float[np.ndarray, "points splines"],
    ]:
        """Values, first and second derivatives."""
        inside = np.clip(x, self._first, self._last)
        piece = (inside[:, :, None] >= self._table[:, 1:, 0]).sum(axis=2)
        left, a, b, c, d = np.moveaxis(self._table[np.arange(len(self._table)), piece], -1, 0)
        h = inside - left
        slope = b + h * (2 * c + 3 * h * d)
        value = a + h * (b + h * (c + h * d)) + slope * (x - inside)
        return value, slope, np.where(x == inside, 2 * c + 6 * h * d, 0.0)


@lru_cache(maxsize=4096)
def _pieces(x: tuple[float, ...], y: tuple[float, ...]) -> Float[np.ndarray, "pieces 5"]:
    """Where each begins; there its value, slope, half its second, a sixth of its third derivative."""
    knots = np.array(x)
    return np.column_stack([knots[:-1], _simm_coefficients(knots, np.array(y))])


def _simm_coefficients(
    knots: Float[np.ndarray, " knots"], heights: Float[np.ndarray, " knots"]
) -> Float[np.ndarray, "pieces 4"]:
    """Value, slope, half the second and a sixth of the third derivative at the left knot of each piece.

    The unknowns are the second derivatives at the knots: slopes are continuous at inner knots, and the third
    derivative of the end pieces is known.
    """
    n = len(knots)
    width = np.diff(knots)
    secant = np.diff(heights) / width
    if n == 2:
        return np.array([[heights[0], secant[0], 0.0, 0.0]])
    system = np.zeros((3, n))  # upper, main and lower diagonal, as solve_banded wants them
    demand = np.zeros(n)
    system[0, 2:] = width[1:]
    system[1, 1:-1] = 2 * (width[:-1] + width[1:])
    system[2, :-2] = width[:-1]
    demand[1:-1] = 6 * np.diff(secant)
    system[0, 1], system[1, 0] = 1.0, -1.0
    system[2, -2], system[1, -1] = -1.0, 1.0
    if n > 3:
        demand[0] = width[0] * _third_derivative(knots[:4], heights[:4])
        demand[-1] = width[-1] * _third_derivative(knots[-4:], heights[-4:])
    bend = solve_banded((1, 1), system, demand)
    slope = secant - width * (2 * bend[:-1] + bend[1:]) / 6
    return np.stack([heights[:-1], slope, bend[:-1] / 2, np.diff(bend) / (6 * width)], axis=1)


def _third_derivative(x: Float[np.ndarray, "4"], y: Float[np.ndarray, "4"]) -> float:
    """Third derivative of the cubic through four points."""
    first = np.diff(y) / np.diff(x)
    second = np.diff(first) / (x[2:] - x[:-2])
    return float(6 * (second[1] - second[0]) / (x[3] - x[0]))
