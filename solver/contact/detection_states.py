"""The likeliest story of a trial: when each foot was up, measured, or on the ground with force missing."""

from dataclasses import dataclass
from enum import IntEnum
from itertools import product

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import log_ndtr

from solver.contact.detection_balance import Balance
from solver.contact.detection_settings import DetectionSettings


class Foot(IntEnum):
    """What one foot does."""

    UP = 0
    MEASURED = 1
    LOST = 2  # on the ground, its force not measured or not all of it


@dataclass(frozen=True)
class Story:
    """The cheapest sequence of states."""

    feet: Int[np.ndarray, "frames feet"]  # of `Foot`
    elsewhere: Bool[np.ndarray, " frames"]  # something else than a foot carries the body


def missing_odds(
    balance: Balance, weight: float, settings: DetectionSettings
) -> Float[np.ndarray, " frames"]:
    """Natural log odds of 'some force is missing' against 'none', one independent moment's worth.

    Without missing force the balance is N(0, σ²); with, it is anything up to `most_missing` body weights,
    plus the same error.

    Args:
        balance: of the whole body.
        weight: [N].
        settings: thresholds.
    """
    z = balance.missing / balance.error
    width = settings.most_missing * weight / balance.error
    odds = log_ndtr(z) - np.log(width) + 0.5 * z**2 + 0.5 * np.log(2 * np.pi)
    return np.clip(odds, -settings.strongest_evidence, settings.strongest_evidence)


def likeliest_story(
    odds_missing: Float[np.ndarray, " frames"],
    odds_ground: Float[np.ndarray, "frames feet"],
    loaded: Bool[np.ndarray, "frames feet"],
    *,
    rate: float,
    settings: DetectionSettings,
) -> Story:
    """Viterbi's path through the joint states of all feet.

    Args:
        odds_missing: log odds that some force is missing.
        odds_ground: log odds that each foot stands, from its motion.
        loaded: frames on which a plate carries the foot.
        rate: [Hz].
        settings: costs.
    """
    frames, feet = loaded.shape
    states = np.array([(*s, x) for s in product(Foot, repeat=feet) for x in (0, 1)])
    cost = _frame_costs(states, odds_missing, odds_ground, loaded, settings) / (settings.steady_s * rate)
    steady, at_edges = _change_costs(states, settings)
    edge = np.zeros((frames, feet), dtype=bool)
    edge[1:] = loaded[1:] != loaded[:-1]
    path = _cheapest(cost, steady, at_edges, edge)
    chosen = states[path]
    return Story(feet=chosen[:, :feet], elsewhere=chosen[:, feet].astype(bool))


def _frame_costs(states, odds_missing, odds_ground, loaded, settings):
    cost = np.zeros((len(loaded), len(states)))
    for k, state in enumerate(states):
        for f, foot in enumerate(state[:-1]):
            cost[:, k] += odds_ground[:, f] * (0.5 if foot == Foot.UP else -0.5)
            if foot != Foot.LOST:
                cost[:, k] += settings.unloaded_cost * (loaded[:, f] != (foot == Foot.MEASURED))
        if state[-1] or (state[:-1] == Foot.LOST).any():
            cost[:, k] -= odds_missing
    return cost


def _change_costs(states, settings):
    """Costs of going from one joint state (row) to another (column); extra cost per foot away from load edges."""
    n, feet = len(states), states.shape[1] - 1
    steady = np.zeros((n, n))
    lost = np.zeros((feet, n, n), dtype=bool)
    for i, a in enumerate(states):
        for j, b in enumerate(states):
            changed = a != b
            steady[i, j] = settings.touch_cost * sum(
                changed[f] and Foot.LOST in (a[f], b[f]) for f in range(feet)
            )
            steady[i, j] += settings.loss_cost * changed[-1]
            for f in range(feet):
                lost[f, i, j] = changed[f] and {int(a[f]), int(b[f])} == {Foot.LOST, Foot.MEASURED}
    return steady, lost * settings.loss_cost


def _cheapest(cost, steady, at_edges, edge):
    frames, n = cost.shape
    total = cost[0].copy()
    origin = np.zeros((frames, n), dtype=int)
    tables = {}
    for t in range(1, frames):
        key = tuple(edge[t])
        if key not in tables:
            tables[key] = steady + sum(table for e, table in zip(key, at_edges) if not e)
        through = total[:, None] + tables[key]
        origin[t] = through.argmin(axis=0)
        total = through[origin[t], np.arange(n)] + cost[t]
    path = np.empty(frames, dtype=int)
    path[-1] = total.argmin()
    for t in range(frames - 1, 0, -1):
        path[t - 1] = origin[t, path[t]]
    return path
