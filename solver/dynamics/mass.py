"""The subject's mass from what the plates carried, over all trials."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import (
    FEWEST_FRAMES,
    ComData,
    MassEstimate,
    estimate_mass_ratio,
    fit_com_trajectory,
    project,
)

# [s] force and motion are held against each other as averages over it: three times what the 5 Hz low-pass
# spreads, half a step
WINDOW_S = 0.3
# of the greatest force required around it, at least body weight: a window off by more tells nothing about
# the mass; measured steps of all kinds stay below it, a foot beside the plates above
IMBALANCE = 0.15
# the search for the mass starts from the greatest that balances half as many frames as the best: a missing
# foot makes windows too light, never too heavy
START_SHARE = 0.5

GUESSES = np.linspace(0.05, 0.95, 19)  # quantiles of what short windows tell
ROUNDS = 10  # of choosing frames by the mass and the mass by the frames; real recordings take two or three
SETTLED_KG = 1e-3
WELL_LOADED = 0.5  # of gravity: below it the ratio of force to acceleration is noise
LIGHTEST_KG = 5.0  # whoever stands on a plate weighs more: it is empty
LEAN_DEG = 4.0  # 7 %: forces that lean farther on average are in axes of a sloping belt, not of a floor
LEAN_S = 1.0  # of known forces, for their average to say so: a stride


@dataclass(frozen=True)
class Balance:
    """Upward force and the support that the motion demands per kilogram, averaged around each frame."""

    force_up: Float[np.ndarray, " frames"]  # [N]
    acceleration_ground: Float[np.ndarray, "frames 3"]  # [m/s²] of the trajectory that knows no force
    support: Float[np.ndarray, " frames"]  # [m/s²] upward acceleration less gravity's
    greatest: Float[np.ndarray, " frames"]  # [m/s²] support in the window, not averaged; at least gravity's
    complete: Bool[np.ndarray, " frames"]  # every frame of the window has its force
    observed: Bool[np.ndarray, " frames"]
    window: int  # frames, odd
    gravity: float  # [m/s²]
    told: dict[bytes, MassEstimate | None] = field(default_factory=dict)  # by the frames that count

    @property
    def masses(self) -> Float[np.ndarray, " some"]:
        """Mass that each complete and loaded window tells [kg]."""
        well = self.complete & (self.support > WELL_LOADED * self.gravity)
        masses = self.force_up[well] / self.support[well]
        return masses[masses > LIGHTEST_KG]

    def frames(self, mass_kg: float, imbalance: float) -> Bool[np.ndarray, " frames"]:
        """Observed frames in no window whose force is off by more than that share of its greatest."""
        allowed = imbalance * mass_kg * self.greatest
        off = self.complete & (np.abs(mass_kg * self.support - self.force_up) > allowed)
        return self.observed & ~maximum_filter1d(off, self.window, mode="constant")


def balance(data: ComData, settings: ComSettings) -> Balance:
    """Force beside motion; the accelerations are those of a trajectory that knows no force at all."""
    strength = float(np.linalg.norm(data.gravity))
    up = -data.gravity / strength
    without_forces = fit_com_trajectory(replace(data, observed=np.zeros(data.frames, dtype=bool)), settings)
    window = 2 * round(WINDOW_S * data.rate / 2) + 1
    support = without_forces.acceleration_ground @ up + strength
    return Balance(
        acceleration_ground=without_forces.acceleration_ground,
        force_up=uniform_filter1d(data.force_ground @ up, window, mode="nearest"),
        support=uniform_filter1d(support, window, mode="nearest"),
        greatest=np.maximum(maximum_filter1d(support, window), strength),
        complete=minimum_filter1d(data.observed, window, mode="constant"),
        observed=data.observed,
        window=window,
        gravity=strength,
    )


def mass_from_forces(trials: Sequence[ComData], settings: ComSettings) -> MassEstimate | None:
    """The mass of least squares in the centre of mass' trajectories, pooled over trials.

    Forces that lean although nobody is accelerated, as those of a sloping belt in its own axes, weigh along
    their own direction. Frames on which the force is off what the motion demands don't count: a step beside
    the plates that nobody flagged, a chair. As that needs the mass, both are found in turns. Trials differ by
    more than their own noise, because plates do; that enters their weights.

    Args:
        trials: with the frames known to miss a force already unobserved.
        settings: errors and thresholds.

    Returns:
        None when nobody's weight rested on the plates.
    """
    trials = [trial for trial in trials if trial.frames >= FEWEST_FRAMES]
    balances = [balance(trial, settings) for trial in trials]
    start = _first_guess(balances)
    found = None if start is None else _pooled_mass(trials, balances, start, settings)
    for _ in range(ROUNDS):
        previous, found = found, found and _pooled_mass(trials, balances, found.mass_kg, settings)
        if previous is None or found is None or abs(found.mass_kg - previous.mass_kg) < SETTLED_KG:
            break
    return found


def _first_guess(balances: Sequence[Balance]) -> float | None:
    """The greatest mass that balances nearly as many frames as any."""
    masses = np.concatenate([np.empty(0), *(b.masses for b in balances)])
    if not len(masses):
        return None
    guesses = np.quantile(masses, GUESSES)
    frames = np.array([sum(b.frames(m, IMBALANCE).sum() for b in balances) for m in guesses])
    return float(guesses[frames >= START_SHARE * frames.max()][-1])


def _pooled_mass(
    trials: Sequence[ComData], balances: Sequence[Balance], mass_kg: float, settings: ComSettings
) -> MassEstimate | None:
    """All trials' mass from the frames that balance with a given one."""
    estimates = []
    for trial, held in zip(trials, balances, strict=True):
        observed = held.frames(mass_kg, IMBALANCE)
        if observed.sum() < held.window:
            continue
        counted = observed.tobytes()  # often the same for another mass
        if counted not in held.told:
            held.told[counted] = _mass_of(trial, held, observed, settings)
        if (own := held.told[counted]) is not None:
            estimates.append(own)
    return pool_masses(estimates, settings) if estimates else None


def _mass_of(
    trial: ComData, held: Balance, observed: Bool[np.ndarray, " frames"], settings: ComSettings
) -> MassEstimate | None:
    gravity, lean_deg = _gravity_of_forces(trial, held, observed)
    projection = project(replace(trial, observed=observed, gravity=gravity), settings.penalty_s2(observed))
    ratio = estimate_mass_ratio(projection, trial.rate, settings)
    return None if ratio is None or ratio.mass is None else replace(ratio.mass, lean_deg=lean_deg)


def _gravity_of_forces(
    trial: ComData, held: Balance, observed: Bool[np.ndarray, " frames"]
) -> tuple[Float[np.ndarray, "3"], float]:
    """Gravity in the axes of the forces [m/s²], and how far they lean [°]; the trial's own where they do not.

    Of mean force f and acceleration a, mass m and gravity follow from |f/m − a| = g.
    """
    strength = float(np.linalg.norm(trial.gravity))
    f, a = trial.force_ground[observed].mean(axis=0), held.acceleration_ground[observed].mean(axis=0)
    per_kg = np.roots([f @ f, -2 * f @ a, a @ a - strength**2]).real.max()
    gravity = a - per_kg * f
    lean_deg = float(np.degrees(np.arccos(np.clip(gravity @ trial.gravity / strength**2, -1.0, 1.0))))
    if lean_deg < LEAN_DEG or observed.sum() < LEAN_S * trial.rate:
        return trial.gravity, 0.0
    return gravity, lean_deg


def pool_masses(estimates: Sequence[MassEstimate], settings: ComSettings) -> MassEstimate:
    """Random-effects mean of several trials' masses (DerSimonian & Laird 1986).

    The scatter between trials that their own noise doesn't explain adds to every trial's variance. The
    plates' gain comes on top, undivided: trials of one laboratory share it.
    """
    mass = np.array([e.mass_kg for e in estimates])
    variance = np.array([e.sampling_std_kg for e in estimates]) ** 2
    weight = 1 / variance
    excess = np.sum(weight * (mass - np.average(mass, weights=weight)) ** 2) - (len(mass) - 1)
    between = max(0.0, excess / (weight.sum() - np.sum(weight**2) / weight.sum())) if len(mass) > 1 else 0.0
    weight = 1 / (variance + between)
    mean = float(np.average(mass, weights=weight))
    sampling = float(weight.sum() ** -0.5)
    std = float(np.hypot(sampling, settings.plate_gain_std * mean))
    return MassEstimate(mean, std, sampling, max(e.lean_deg for e in estimates))
