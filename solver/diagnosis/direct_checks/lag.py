"""Timing of the forces: how late they are against the markers, and whether a filter took their edges away.

Feet strike and leave within some hundredths of a second whatever the person does in between, and a low-pass
at 4 to 8 Hz takes nearly all of that away.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from solver.capture.plates.conditioning import fill_gaps
from solver.common.gravity import GRAVITY
from solver.diagnosis.causes.contact_edges import (
    QUICK_HZ,
    SLOW_HZ,
    SOUND,
    fall_off,
    filtered_nats,
    usual_fall_off,
)
from solver.diagnosis.direct_checks.measured import FEWEST_S, Measured
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of

LAG, EDGES = "lag", "edges of contacts"
LAG_BIAS_S = -0.004  # of the method: soft tissue lags behind the bones that the forces move
LAG_SCATTER_S = 0.006  # -9, -4, -3 ms in three sound walks of three people
LAG_USUAL_S = 0.03  # a trigger line, a filter's delay, a hand-set start
TRIAL_LAG_SCATTER_S = 0.004  # between trials of one person
LEAST_AGREEMENT = 0.9  # correlation of force and motion, from which on a lag means something
MOST_LAG_S = 0.2  # farther off, another step would fit as well

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
    acceleration, mass, counts = trial.acceleration, trial.usual_kg, trial.borne
    if mass is None:
        return None
    lags = np.arange(-MOST_LAG_S, MOST_LAG_S + COARSE_S / 2, COARSE_S)
    rough = np.array([_agreement(trial, lag, mass, counts) for lag in lags])
    if not np.isfinite(rough).any():
        return None
    lags = lags[np.nanargmax(rough)] + np.arange(-COARSE_S, COARSE_S + STEP_S / 2, STEP_S)
    agreements = np.array([_agreement(trial, lag, mass, counts) for lag in lags])
    if not np.isfinite(agreements).all():
        return None
    best = int(np.argmax(agreements))
    known = np.isfinite(acceleration)
    if agreements[best] < LEAST_AGREEMENT or acceleration[known].std() < LEAST_SWING:
        return None
    if not 0 < best < len(lags) - 1:
        return None
    before, at, after = agreements[best - 1 : best + 2]
    bend = before - 2 * at + after
    fine = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return Lag(trial.capture.name, float(lags[best] + fine * STEP_S - LAG_BIAS_S), float(agreements[best]))


def lag(trials: Sequence[Measured]) -> list[Statement]:
    """Each trial by itself, and the one that stands off from the others."""
    found = [one for trial in trials if (one := lag_of(trial)) is not None]
    said = []
    for one in found:
        nats = nats_of(one.lag_s, 0.0, LAG_SCATTER_S, LAG_USUAL_S)
        said.append(
            Statement(
                LAG,
                f"The forces come {1e3 * abs(one.lag_s):.0f} ms {'after' if one.lag_s > 0 else 'before'} the "
                f"acceleration of the markers (correlation {one.agreement:.2f}; normal: within 12 ms).",
                {About.CLOCK: nats},
                {"lag_s": one.lag_s, "agreement": one.agreement},
                trial=one.trial,
            )
        )
    if len(found) > 1:
        said.append(_compare_trials(found, trials))
    return said


def _compare_trials(found: Sequence[Lag], trials: Sequence[Measured]) -> Statement:
    lags = np.array([one.lag_s for one in found])
    away = [float(value - np.median(np.delete(lags, k))) for k, value in enumerate(lags)]
    k = int(np.argmax(np.abs(away)))
    nats = nats_of(away[k], 0.0, TRIAL_LAG_SCATTER_S, LAG_USUAL_S)
    others = tuple(one.trial for n, one in enumerate(found) if n != k)
    return Statement(
        LAG,
        f"The forces come {1e3 * abs(away[k]):.0f} ms {'later' if away[k] > 0 else 'earlier'} than in the "
        "other trials (normal: within 8 ms): the clocks differ from trial to trial.",
        {About.CLOCK: nats},
        {"lag_beyond_others_s": away[k]},
        trial=found[k].trial,
        against=others,
    )


def _agreement(trial: Measured, late_s: float, mass_kg: float, counts: Bool[np.ndarray, " frames"]) -> float:
    plates = trial.capture.plates
    total = np.sum([trial.smooth(p, late_s) for p in plates], axis=0)
    asked = mass_kg * (GRAVITY + trial.acceleration)
    known = np.isfinite(total) & counts
    if known.sum() / trial.rate < FEWEST_S:
        return float("nan")
    return float(np.corrcoef(total[known], asked[known])[0, 1])


def contact_edges(trials: Sequence[Measured]) -> list[Statement]:
    """Each trial, over all contacts that begin or end in it."""
    return [said for trial in trials if (said := _of_trial(trial)) is not None]


def _of_trial(trial: Measured) -> Statement | None:
    edges = []
    for plate in trial.capture.plates:
        whole, _, _ = fill_gaps(plate, trial.reading.conditioning)
        edges += fall_off(whole.force_ground[:, 1], plate.rate)
    fall = usual_fall_off(edges)
    if fall is None:
        return None
    share, usual = math.exp(fall), math.exp(SOUND)
    return Statement(
        EDGES,
        f"Where contacts begin and end, the forces at {QUICK_HZ:.0f} Hz are {100 * share:.2g} % of those at "
        f"{SLOW_HZ:.0f} Hz; {100 * usual:.0f} % is usual (normal: at least a quarter of that).",
        {About.FILTER: filtered_nats(fall)},
        {"quick_share": share, "usual_share": usual, "edges": float(len(edges))},
        trial=trial.capture.name,
    )
