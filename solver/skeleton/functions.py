"""Scalar functions of one coordinate, as OpenSim models use them, with two derivatives."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from jaxtyping import Float

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

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        p = np.poly1d(self.coefficients)
        return p(x), p.deriv(1)(x), p.deriv(2)(x)


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

    The end slopes' curvature follows SIMM: the third derivative of the first (last) piece equals that of the
    cubic through the first (last) four knots. With fewer than four knots it is zero.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]

    @cached_property
    def _coefficients(self) -> tuple[Float[np.ndarray, " knots"], Float[np.ndarray, "pieces 4"]]:
        return np.array(self.x), _simm_coefficients(np.array(self.x), np.array(self.y))

    def __call__(self, x: Values) -> tuple[Values, Values, Values]:
        """Value, first and second derivative."""
        knots, table = self._coefficients
        inside = np.clip(x, knots[0], knots[-1])
        piece = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, len(knots) - 2)
        a, b, c, d = np.moveaxis(table[piece], -1, 0)
        h = inside - knots[piece]
        value = a + h * (b + h * (c + h * d))
        slope = b + h * (2 * c + 3 * h * d)
        curvature = np.where(x == inside, 2 * c + 6 * h * d, 0.0)
        return value + slope * (x - inside), slope, curvature


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
