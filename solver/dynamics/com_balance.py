"""Frames whose forces carry the body: averages of force and motion over a third of a second, side by side."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from solver.dynamics.com_data import ComData
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import fit_com_trajectory

WELL_LOADED = 0.5  # of gravity: below it the ratio of force to acceleration is noise
LIGHTEST_KG = 5.0  # whoever stands on a plate weighs more: it is empty


@dataclass(frozen=True)
class Balance:
    """Upward force and the support that the motion demands per kilogram, averaged around each frame."""

    force_up: Float[np.ndarray, " frames"]  # [N]
    support: Float[np.ndarray, " frames"]  # [m/s²] upward acceleration less gravity's
    greatest: Float[np.ndarray, " frames"]  # [m/s²] support in the window, not averaged; at least gravity's
    complete: Bool[np.ndarray, " frames"]  # every frame of the window has its force
    observed: Bool[np.ndarray, " frames"]
    window: int  # frames, odd
    gravity: float  # [m/s²]

    @property
    def masses(self) -> Float[np.ndarray, " some"]:
        """Mass that each complete and loaded window tells [kg]."""
        well = self.complete & (self.support > WELL_LOADED * self.gravity)
        told = self.force_up[well] / self.support[well]
        return told[told > LIGHTEST_KG]

    def frames(self, mass_kg: float, imbalance: float) -> Bool[np.ndarray, " frames"]:
        """Observed frames in no window whose force is off by more than that share of its greatest."""
        allowed = imbalance * mass_kg * self.greatest
        off = self.complete & (np.abs(mass_kg * self.support - self.force_up) > allowed)
        return self.observed & ~maximum_filter1d(off, self.window, mode="constant")


def balance(data: ComData, settings: ComSettings) -> Balance:
    """Force beside motion; the accelerations are those of a trajectory that knows no force at all."""
    strength = float(np.linalg.norm(data.gravity))
    up = -data.gravity / strength
    blind = fit_com_trajectory(replace(data, observed=np.zeros(data.frames, dtype=bool)), settings)
    window = 2 * round(settings.window_s * data.rate / 2) + 1
    support = blind.acceleration_ground @ up + strength
    return Balance(
        force_up=uniform_filter1d(data.force_ground @ up, window, mode="nearest"),
        support=uniform_filter1d(support, window, mode="nearest"),
        greatest=np.maximum(maximum_filter1d(support, window), strength),
        complete=minimum_filter1d(data.observed, window, mode="constant"),
        observed=data.observed,
        window=window,
        gravity=strength,
    )
