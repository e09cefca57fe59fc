"""A motion as a quintic spline with even knots: position, velocity and acceleration exact at any time.

And the same motion on a floor that accelerates, seen by cameras that move with it.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import BSpline, PPoly

from solver.skeleton.forward import cross
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

DEGREE = 5
ACTIVE = DEGREE + 1  # basis functions that are not zero at a time


@dataclass(frozen=True)
class SplineMotion:
    """Generalized coordinates q(t) = Σ_k N_k(t) c_k between `start` and `end`."""

    dofs: tuple[str, ...]
    coefficients: Float[np.ndarray, "coefficients dofs"]  # [rad or m]
    start: float  # [s]
    spacing: float  # [s] between knots

    @property
    def end(self) -> float:
        """Last time of the spline [s]."""
        return self.start + self.spacing * (len(self.coefficients) - DEGREE)

    def derivative(self, times: Float[np.ndarray, " times"], order: int) -> Float[np.ndarray, "times dofs"]:
        """The order-th derivative [rad/sⁿ or m/sⁿ]."""
        last = len(self.coefficients) - ACTIVE
        first, weights = local_basis((times - self.start) / self.spacing, order, self.spacing, last)
        return np.einsum("tk,tkd->td", weights, self.coefficients[first[:, None] + np.arange(ACTIVE)])

    def state(
        self, times: Float[np.ndarray, " times"]
    ) -> tuple[
        Float[np.ndarray, "times dofs"], Float[np.ndarray, "times dofs"], Float[np.ndarray, "times dofs"]
    ]:
        """q, q̇ and q̈ at those times."""
        return self.derivative(times, 0), self.derivative(times, 1), self.derivative(times, 2)


def coefficient_count(duration: float, spacing: float) -> int:
    """Coefficients of a spline that covers a duration [s]."""
    return int(np.ceil(duration / spacing - 1e-9)) + DEGREE


def local_basis(
    position: Float[np.ndarray, " times"], order: int, spacing: float, last: int
) -> tuple[Int[np.ndarray, " times"], Float[np.ndarray, "times active"]]:
    """Index of the first active coefficient, and the weights of the active ones.

    Args:
        position: time since the spline's start, in knot intervals.
        order: of the derivative.
        spacing: [s] between knots.
        last: knot interval; times beyond either end extend the pieces there.
    """
    first = np.clip(np.floor(position + 1e-9).astype(int), 0, last)
    inside = position - first
    weights = np.stack([np.polyval(piece, inside) for piece in _pieces(order)], axis=-1)
    return first, weights / spacing**order


@cache
def _pieces(order: int) -> tuple[Float[np.ndarray, " powers"], ...]:
    """Polynomials on one interval of the basis functions that are active there, the oldest first."""
    cardinal = PPoly.from_spline(BSpline.basis_element(np.arange(ACTIVE + 1.0), extrapolate=False))
    inner = np.flatnonzero((cardinal.x[:-1] >= 0) & (np.diff(cardinal.x) > 0))[:ACTIVE]
    return tuple(np.polyder(np.poly1d(cardinal.c[:, piece]), order).coeffs for piece in inner[::-1])


@dataclass(frozen=True)
class MovingSupport:
    """The acceleration of the support as a sum of sines along one direction.

    Motions are relative to the support, so that each particle of mass m feels −m a besides its weight.
    """

    skeleton: Skeleton
    direction_ground: Float[np.ndarray, "3"]
    waves: tuple[tuple[float, float, float], ...]  # amplitude [m/s²], frequency [Hz], phase [rad]

    def acceleration(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 3"]:
        """Of the support [m/s²]."""
        time_history = np.zeros(len(times))
        for amplitude, frequency, phase in self.waves:
            time_history += amplitude * np.sin(2 * np.pi * frequency * times + phase)
        return time_history[:, None] * self.direction_ground

    def __call__(
        self, motion: SplineMotion, times: Float[np.ndarray, " times"]
    ) -> Float[np.ndarray, "times 6"]:
        """Force [N] and moment about the ground origin [N·m]."""
        force = -self.skeleton.mass * self.acceleration(times)
        com = RigidBodyModel(self.skeleton).centre_of_mass(motion.derivative(times, 0))
        return np.concatenate([force, cross(com, force)], axis=1)
