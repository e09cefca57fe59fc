"""Lag per trial: by how much the plates' forces come after the acceleration that the markers show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from solver.common.gravity import GRAVITY
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of

DIRECT_CHECK = "lag"
COARSE_S, STEP_S = 0.01, 0.002  # a step lasts ten times as long: there is one best lag nearby
LEAST_SWING = 0.5  # [m/s²] root mean square: quiet standing has no time


@dataclass(frozen=True)
class Lag:
    """Of all plates of one trial together."""

    trial: str
    lag_s: float  # the method's own taken off; positive: forces are late
    agreement: float


def lag_of(trial: Measured) -> Lag | None:
    """By the best correlation, with a parabola through the three best; None where nothing is clear.

    Frames on which a foot may be beside the plates are left out.
    """
    settings = trial.settings
    acceleration, mass, counts = trial.acceleration, trial.usual_kg, trial.borne
    if mass is None:
        return None
    lags = np.arange(-settings.most_lag_s, settings.most_lag_s + COARSE_S / 2, COARSE_S)
    rough = np.array([_agreement(trial, lag, mass, counts) for lag in lags])
    if not np.isfinite(rough).any():
        return None
    lags = lags[np.nanargmax(rough)] + np.arange(-COARSE_S, COARSE_S + STEP_S / 2, STEP_S)
    agreements = np.array([_agreement(trial, lag, mass, counts) for lag in lags])
    if not np.isfinite(agreements).all():
        return None
    best = int(np.argmax(agreements))
    known = np.isfinite(acceleration)
    if agreements[best] < settings.least_agreement or acceleration[known].std() < LEAST_SWING:
        return None
    if not 0 < best < len(lags) - 1:
        return None
    before, at, after = agreements[best - 1 : best + 2]
    bend = before - 2 * at + after
    fine = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return Lag(
        trial.capture.name, float(lags[best] + fine * STEP_S - settings.lag_bias_s), float(agreements[best])
    )


def lag(trials: Sequence[Measured]) -> list[Statement]:
    """Each trial by itself, and the one that stands off from the others."""
    found = [one for trial in trials if (one := lag_of(trial)) is not None]
    said = []
    for one in found:
        settings = trials[0].settings
        nats = nats_of(one.lag_s, 0.0, settings.lag_scatter_s, settings.lag_usual_s)
        said.append(
            Statement(
                DIRECT_CHECK,
                f"The forces come {1e3 * abs(one.lag_s):.0f} ms {'after' if one.lag_s > 0 else 'before'} the "
                f"acceleration of the markers (correlation {one.agreement:.2f}; normal: within 12 ms).",
                {About.CLOCK: nats},
                {"lag_s": one.lag_s, "agreement": one.agreement},
                trial=one.trial,
            )
        )
    if len(found) > 1:
        said.append(_between(found, trials))
    return said


def _between(found: Sequence[Lag], trials: Sequence[Measured]) -> Statement:
    settings = trials[0].settings
    lags = np.array([one.lag_s for one in found])
    away = [float(value - np.median(np.delete(lags, k))) for k, value in enumerate(lags)]
    k = int(np.argmax(np.abs(away)))
    nats = nats_of(away[k], 0.0, settings.trial_lag_scatter_s, settings.lag_usual_s)
    others = tuple(one.trial for n, one in enumerate(found) if n != k)
    return Statement(
        DIRECT_CHECK,
        f"The forces come {1e3 * abs(away[k]):.0f} ms {'later' if away[k] > 0 else 'earlier'} than in the "
        "other trials (normal: within 8 ms): the clocks differ from trial to trial.",
        {About.CLOCK: nats},
        {"lag_beyond_others_s": away[k]},
        trial=found[k].trial,
        against=others,
    )


def _agreement(trial: Measured, late_s: float, mass_kg: float, counts: Bool[np.ndarray, " frames"]) -> float:
    plates = trial.capture.plates
    total = np.sum([trial.smoothed(p, late_s) for p in plates], axis=0)
    asked = mass_kg * (GRAVITY + trial.acceleration)
    known = np.isfinite(total) & counts
    if known.sum() / trial.rate < trial.settings.fewest_s:
        return float("nan")
    return float(np.corrcoef(total[known], asked[known])[0, 1])
