"""The Gauss-Newton system of all trials: a band each, bordered by the parameters that they share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.dynamics.band_cholesky import BandCholesky
from solver.dynamics.spline_band import CoefficientBand


@dataclass(frozen=True)
class Gradient:
    """Of half the cost."""

    coefficients: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # by trials
    shared: Float[np.ndarray, " shared"]


@dataclass(frozen=True)
class TrialTerms:
    """What one trial adds to half the cost, to second order."""

    band: CoefficientBand
    gradient: Float[np.ndarray, "coefficients dofs"]
    border: Float[np.ndarray, "coefficients dofs shared"]
    corner: Float[np.ndarray, "shared shared"]
    gradient_corner: Float[np.ndarray, " shared"]
    cost: float  # whole, not half


@dataclass(frozen=True)
class Step:
    """From where the gradient was taken to the minimum of the quadratic model."""

    coefficients: tuple[Float[np.ndarray, "coefficients dofs"], ...]
    shared: Float[np.ndarray, " shared"]
    foretold: float  # by how much it lowers the cost, if that is quadratic


class BorderedFactor:
    """The factored system: trials' coefficients are eliminated first, which leaves the small border."""

    def __init__(
        self,
        trials: Sequence[TrialTerms],
        shared_curvature: Float[np.ndarray, "shared shared"],
        damping: float = 0.0,
    ) -> None:
        """Factor, in the place of the trials' bands and borders, which are gone afterwards.

        Args:
            trials: terms of each.
            shared_curvature: of the shared parameters, from their priors.
            damping: share of itself by which the bands' diagonal is enlarged (Marquardt).
        """
        self.corner = shared_curvature.copy()
        self.factors: list[BandCholesky] = []
        self.half_borders: list[Float[np.ndarray, "coefficients dofs shared"]] = []
        for part in trials:
            factor = part.band.factorized_in_place(damping)
            half = factor.half_solve_in_place(part.border)
            flat = half.reshape(half.shape[0] * half.shape[1], half.shape[2])
            self.corner += part.corner - flat.T @ flat
            self.factors.append(factor)
            self.half_borders.append(half)

    def step(self, gradient: Gradient) -> Step:
        """Down this gradient, which may be of another place than the factored curvature."""
        shared_gradient, foretold, halves = gradient.shared.copy(), 0.0, []
        for factor, border, own in zip(self.factors, self.half_borders, gradient.coefficients, strict=True):
            half = factor.half_solve_in_place(own[:, :, None].copy())
            shared_gradient -= border.reshape(half.size, border.shape[2]).T @ half.ravel()
            foretold += float((half**2).sum())
            halves.append(half)
        shared = np.zeros(0)
        if len(shared_gradient):
            shared = -np.linalg.solve(self.corner, shared_gradient)
            foretold -= float(shared_gradient @ shared)
        steps = [
            -factor.back_solve(half + (border @ shared)[:, :, None])[:, :, 0]
            for factor, border, half in zip(self.factors, self.half_borders, halves, strict=True)
        ]
        return Step(tuple(steps), shared, foretold)
