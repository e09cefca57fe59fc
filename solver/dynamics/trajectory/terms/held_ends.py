"""Ends of a part of a trial that stay where they are: what is beyond them is not asked again."""

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.spline_basis import DEGREE
from solver.dynamics.trajectory.terms.trial_point import TrialPoint

STD = 1e-9  # [rad or m] less than anybody measures; its square is far from what doubles resolve


class HeldEnds:
    """Σ (c − c⁰)²/σ² over the coefficients that act beyond the ends of a part, at a σ of next to nothing.

    All other coefficients act on the part's frames alone. So with these held, its cost is that of the whole
    trial by the others, but for a constant.
    """

    def __init__(
        self, coefficients: Float[np.ndarray, "coefficients dofs"], *, before: bool, after: bool
    ) -> None:
        """Of a part.

        Args:
            coefficients: where they stay.
            before: whether the trial has frames before the part.
            after: whether it has frames after it; then the part's last frame is on a knot.
        """
        self.coefficients = coefficients
        held = np.zeros(len(coefficients), dtype=bool)
        held[:DEGREE] = before
        if after:
            held[-DEGREE:] = True
        self.held: Bool[np.ndarray, " coefficients"] = held

    def _away(self, at: TrialPoint) -> Float[np.ndarray, "held dofs"]:
        return at.coefficients[self.held, : self.coefficients.shape[1]] - self.coefficients[self.held]

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        return float((self._away(at) ** 2).sum()) / STD**2

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        gradient.coefficients[self.held, : self.coefficients.shape[1]] += self._away(at) / STD**2

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """Quadratic, so the band's share is the same everywhere."""
        dofs = np.arange(self.coefficients.shape[1])
        rows = np.flatnonzero(self.held)
        system.band.panels[rows[:, None], dofs, 0, dofs] += 1 / STD**2
        self.add_gradient(at, system.gradient)
        system.cost += self.cost(at)
