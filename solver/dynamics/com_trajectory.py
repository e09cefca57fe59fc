"""The centre of mass' trajectory that obeys F = ma where forces were measured and is continuous elsewhere.

The unknowns of the dataset paper (Werling et al. 2024) are ζ = [z₁, ż₁, μ, z̈_u …]: start, initial velocity,
inverse mass, and the total acceleration of every frame u without a complete force. A ζ + b = [Z, α Z̈_U], and
ζ̂ = A† ([Z; 0] − b) for the measured Z. `com_system` solves that at a cost linear in frames. With a finite
`force_error_m_s2` the accelerations of observed frames, too, may differ from μ f − g by a little.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.dynamics.com_data import ComData
from solver.dynamics.com_mass import MassEstimate, MassPrior, told_ratio
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_system import FEWEST_FRAMES, REFERENCE_KG, project


@dataclass(frozen=True)
class ComTrajectory:
    """A fitted trajectory of the centre of mass: all of ζ is in it."""

    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    acceleration_ground: Float[np.ndarray, "frames 3"]  # [m/s²]
    inverse_mass: float  # μ [1/kg]; zero where nothing tells it
    mass: MassEstimate | None  # None likewise, or where μ is negative
    rate: float  # [Hz]

    @property
    def start_velocity_ground(self) -> Float[np.ndarray, "3"]:
        """ż₁ [m/s], before the first step of semi-implicit Euler."""
        step = self.com_ground[1] - self.com_ground[0]
        return step * self.rate - self.acceleration_ground[0] / self.rate


def fit_com_trajectory(data: ComData, settings: ComSettings, prior: MassPrior | None = None) -> ComTrajectory:
    """Fit the trajectory of one trial.

    Args:
        data: centre of mass from markers, forces, and where these are complete.
        settings: α and the two errors.
        prior: on the mass; a standard deviation of zero fixes it, None leaves it free as in the paper.

    Returns:
        A trial of fewer than three frames comes back as it was.
    """
    if data.frames < FEWEST_FRAMES:
        return unchanged(data)
    projection = project(data, settings.penalty_s2(data.observed))
    ratio = told_ratio(projection, data.rate, settings, prior)
    path = projection.path(ratio.best if ratio else 0.0)
    return ComTrajectory(
        com_ground=path.com_ground,
        acceleration_ground=path.acceleration_ground,
        inverse_mass=ratio.best / REFERENCE_KG if ratio else 0.0,
        mass=ratio.mass if ratio else None,
        rate=data.rate,
    )


def unchanged(data: ComData) -> ComTrajectory:
    """The measured centre of mass as a trajectory, with its second differences and without a mass."""
    com = data.com_ground.copy()
    acceleration = np.zeros_like(com)
    if data.frames >= FEWEST_FRAMES:
        acceleration[1:-1] = np.diff(com, 2, axis=0) * data.rate**2
    return ComTrajectory(com, acceleration, inverse_mass=0.0, mass=None, rate=data.rate)
