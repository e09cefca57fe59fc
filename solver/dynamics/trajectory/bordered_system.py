"""The Gauss-Newton system of all trials: a band each, bordered by the parameters that they share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.trajectory.block_tridiagonal import BandCholesky
from solver.dynamics.trajectory.spline_band import CoefficientBand
from solver.dynamics.trajectory.spline_basis import SplineBasis


@dataclass(frozen=True)
class Gradient:
    """Of half the cost of all trials and the shared parameters' priors."""

    coefficients: tuple[Float[np.ndarray, "coefficients dofs"], ...]  # by trials
    shared: Float[np.ndarray, " shared"]
    cost: float  # whole, not half


@dataclass(eq=False)
class TrialGradient:
    """Of half the cost of one trial, and the cost: zero at first, added to by its terms."""

    coefficients: Float[np.ndarray, "coefficients columns"]
    shared: Float[np.ndarray, " shared"]
    cost: float = 0.0  # whole, not half

    @classmethod
    def zero(cls, shape: tuple[int, ...], shared: int) -> "TrialGradient":
        """For coefficients of this shape and so many shared parameters."""
        return cls(np.zeros(shape), np.zeros(shared))

    def add_frames(
        self, basis: SplineBasis, per_frame: Float[np.ndarray, "frames some"], order: int = 0
    ) -> None:
        """By the order-th derivative of the spline's first columns at the frames."""
        self.coefficients[:, : per_frame.shape[1]] += CoefficientBand.gather(basis, per_frame, order)


@dataclass(eq=False)
class TrialSystem:
    """What one trial adds to half the cost, to second order: zero at first, added to by its terms."""

    band: CoefficientBand
    border: Float[np.ndarray, "coefficients columns shared"]
    corner: Float[np.ndarray, "shared shared"]
    gradient: TrialGradient

    @classmethod
    def zero(cls, basis: SplineBasis, columns: int, shared: int) -> "TrialSystem":
        """For a spline of so many columns and so many shared parameters."""
        shape = basis.coefficients, columns
        return cls(
            CoefficientBand.empty(basis, columns),
            np.zeros((*shape, shared)),
            np.zeros((shared, shared)),
            TrialGradient.zero(shape, shared),
        )


@dataclass(frozen=True)
class Step:
    """From where the gradient was taken to the minimum of the quadratic model."""

    coefficients: tuple[Float[np.ndarray, "coefficients dofs"], ...]
    shared: Float[np.ndarray, " shared"]
    predicted: float  # by how much it lowers the cost, if that is quadratic


@dataclass(frozen=True)
class SharedChoice:
    """Which shared parameters are free, and what a prior adds to half the cost beside the factored one."""

    free: Bool[np.ndarray, " shared"]
    curvature: Float[np.ndarray, "shared shared"]
    gradient: Float[np.ndarray, " shared"]


class BorderedFactor:
    """The factored system: trials' coefficients are eliminated first, which leaves the small border."""

    def __init__(
        self,
        trials: Sequence[TrialSystem],
        shared_curvature: Float[np.ndarray, "shared shared"],
        damping: float = 0.0,
    ) -> None:
        """Factor, in the place of the trials' bands and borders, which are gone afterwards.

        Args:
            trials: the system of each.
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

    def _eliminated(
        self, gradient: Gradient
    ) -> tuple[Float[np.ndarray, " shared"], list[Float[np.ndarray, "coefficients dofs 1"]]]:
        """The shared parameters' gradient when coefficients follow, and half-solved those of the trials."""
        shared, halves = gradient.shared.copy(), []
        for factor, border, own in zip(self.factors, self.half_borders, gradient.coefficients, strict=True):
            half = factor.half_solve_in_place(own[:, :, None].copy())
            shared -= border.reshape(half.size, border.shape[2]).T @ half.ravel()
            halves.append(half)
        return shared, halves

    def reduced(self, gradient: Gradient) -> Float[np.ndarray, " shared"]:
        """By the shared parameters, where the trials' coefficients follow; `corner` is its curvature."""
        return self._eliminated(gradient)[0]

    def step(self, gradient: Gradient) -> Step:
        """Down this gradient, which may be of another place than the factored curvature."""
        count = len(gradient.shared)
        whole = SharedChoice(np.ones(count, dtype=bool), np.zeros((count, count)), np.zeros(count))
        return self.steps(gradient, [whole])[0]

    def steps(self, gradient: Gradient, choices: Sequence[SharedChoice]) -> list[Step]:
        """Likewise, each time with some of the shared parameters free, and with more of a prior on them."""
        reduced, halves = self._eliminated(gradient)
        own = sum(float((half**2).sum()) for half in halves)
        shared = np.zeros((len(choices), len(reduced)))
        predicted = []
        for choice, step in zip(choices, shared, strict=True):
            free, slope = choice.free, reduced + choice.gradient
            if free.any():
                corner = (self.corner + choice.curvature)[np.ix_(free, free)]
                step[free] = -np.linalg.solve(corner, slope[free])
            predicted.append(own - float(slope @ step))
        coefficients = [
            -factor.back_solve(half + border @ shared.T)
            for factor, border, half in zip(self.factors, self.half_borders, halves, strict=True)
        ]
        return [
            Step(tuple(steps[:, :, i] for steps in coefficients), shared[i], predicted[i])
            for i in range(len(choices))
        ]
