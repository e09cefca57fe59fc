"""The subject's mass as one recording tells it: how sure it is, and how it agrees with what was entered."""

from dataclasses import dataclass

import numpy as np

from solver.common.notes import Kind, Note
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_system import REFERENCE_KG, Projection

NOMINAL_BLOCKS = 2  # what the expected error counts for beside the scatter between blocks


@dataclass(frozen=True)
class MassPrior:
    """What is known about the mass beforehand; a standard deviation of zero fixes it."""

    mass_kg: float
    std_kg: float


@dataclass(frozen=True)
class MassEstimate:
    """A mass and its standard deviation, which includes the plates' gain; `sampling_std_kg` does not."""

    mass_kg: float
    std_kg: float
    sampling_std_kg: float  # from errors that differ from step to step
    lean_deg: float = 0.0  # of the forces from the vertical, where it is so large that they are in other axes


@dataclass(frozen=True)
class Standing:
    """A recording in which somebody stands still, and what all plates together read."""

    name: str
    mass: MassEstimate


@dataclass(frozen=True)
class MassRatio:
    """ρ = REFERENCE_KG · μ, the unknown in which the problem is linear."""

    best: float
    std: float
    sampling_std: float

    @property
    def mass(self) -> MassEstimate | None:
        """The mass; None unless it is positive."""
        if self.best <= 0:
            return None
        mass = REFERENCE_KG / self.best
        return MassEstimate(mass, mass * self.std / self.best, mass * self.sampling_std / self.best)


def told_ratio(
    projection: Projection, rate: float, settings: ComSettings, prior: MassPrior | None = None
) -> MassRatio | None:
    """The mass ratio of least squares, weighed against a prior where there is one.

    Noise model: the trajectory's misfits are correlated within blocks of `block_s` and independent between
    them; the scatter between blocks is pooled with the error expected of the centre of mass, which a trial of
    one or two blocks needs. The plates' gain comes on top.

    Args:
        projection: of one trial.
        rate: [Hz].
        settings: errors, blocks and gain.
        prior: None: the trial alone decides.

    Returns:
        None when no force shapes the trajectory and there is no prior.
    """
    data = _data_ratio(projection, rate, settings)
    if prior is None:
        return data
    centre = REFERENCE_KG / prior.mass_kg
    std = centre * prior.std_kg / prior.mass_kg
    if data is None or std == 0:
        return MassRatio(centre, std, 0.0)
    precision = np.array([data.std, std]) ** -2.0
    share = precision / precision.sum()
    best = float(share @ [data.best, centre])
    return MassRatio(best, float(precision.sum() ** -0.5), float(share[0] * data.sampling_std))


def _data_ratio(projection: Projection, rate: float, settings: ComSettings) -> MassRatio | None:
    best = projection.best_ratio
    if best is None:
        return None
    sampling = _sampling_variance(projection, best, rate, settings) ** 0.5
    return MassRatio(best, float(np.hypot(sampling, settings.plate_gain_std * best)), sampling)


def _sampling_variance(projection: Projection, ratio: float, rate: float, settings: ComSettings) -> float:
    """Variance of ρ: scores sum to zero over the trial, and how far each block's do not shows the error."""
    information = projection.information
    score = np.sum(projection.slope.misfit * projection.path(ratio).misfit, axis=1)
    blocks = max(1, round(len(score) / (settings.block_s * rate)))
    starts = np.linspace(0, len(score), blocks, endpoint=False).astype(int)
    total, per_block = information.sum(), np.add.reduceat(information, starts)
    expected = settings.com_error_m**2 * settings.noise_time_s * rate / total
    spare = total**2 / np.sum(per_block**2) - 1  # effective number of blocks, less the one that ρ takes
    if spare <= 0:
        return float(expected)
    scatter = np.sum(np.add.reduceat(score, starts) ** 2) / total**2 * (spare + 1) / spare
    return float((NOMINAL_BLOCKS * expected + spare * scatter) / (NOMINAL_BLOCKS + spare))


def disagreement(estimate: MassEstimate, entered_kg: float, settings: ComSettings) -> Note | None:
    """A warning where the forces tell another mass than somebody entered; None where they agree."""
    apart = estimate.mass_kg - entered_kg
    std = float(np.hypot(estimate.std_kg, settings.entered_mass_std_kg))
    if abs(apart) <= settings.disagreement * std:
        return None
    how, suspect = ("more", "loads carried") if apart > 0 else ("less", "steps beside the plates")
    return Note(
        Kind.ENTERED_MASS,
        f"the forces carry {estimate.mass_kg:.1f} ± {estimate.std_kg:.1f} kg, {abs(apart):.1f} kg {how} "
        f"than the {entered_kg:.1f} kg that were entered",
        advice=f"check the entered mass, the plates' gain, and {suspect}",
    )
