"""The likeliest story of a trial: when each foot was up, measured, or on the ground with force missing."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from itertools import product

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import log_ndtr

from solver.contact.detection_place import Feet
from solver.contact.detection_settings import DetectionSettings


class Foot(IntEnum):
    """What one foot does."""

    UP = 0
    MEASURED = 1
    LOST = 2  # on the ground, its force not measured or not all of it


@dataclass(frozen=True)
class Clues:
    """What speaks for and against each state, frame by frame: natural logarithms of odds."""

    missing: Float[np.ndarray, " frames"]  # that some force is missing, whichever
    partly: Float[np.ndarray, "frames feet"]  # that a loaded foot's force is measured in part only
    ground: Float[np.ndarray, "frames feet"]  # that the foot stands, from its motion
    place: Mapping[Feet, Float[np.ndarray, " frames"]]  # against these feet, from where the force presses
    loaded: Bool[np.ndarray, "frames feet"]  # a plate carries the foot
    rate: float  # [Hz]


@dataclass(frozen=True)
class Story:
    """The likeliest sequence of states."""

    feet: Int[np.ndarray, "frames feet"]  # of `Foot`
    elsewhere: Bool[np.ndarray, " frames"]  # something else than a foot carries a part of the body

    @property
    def whole(self) -> Bool[np.ndarray, " frames"]:
        """Frames on which nothing is missing."""
        return ~((self.feet == Foot.LOST).any(axis=1) | self.elsewhere)


def missing_odds(
    missing: Float[np.ndarray, " frames"],
    error: Float[np.ndarray, " frames"],
    least: Float[np.ndarray, " frames"] | float,
    most: Float[np.ndarray, " frames"] | float,
    strongest: float,
) -> Float[np.ndarray, " frames"]:
    """Natural log odds of 'a force between least and most is missing' against 'none is'.

    Without missing force the balance is N(0, σ²); with, it is any of these forces alike, plus the same error.

    Args:
        missing: from the balance [N].
        error: σ [N].
        least: [N].
        most: [N].
        strongest: what one frame can say at most, for or against.
    """
    z, low, high = missing / error, least / error, most / error
    width = np.maximum(high - low, 1e-6)
    within = log_ndtr(z - low) + np.log1p(-np.exp(np.minimum(log_ndtr(z - high) - log_ndtr(z - low), -1e-9)))
    odds = within - np.log(width) + 0.5 * z**2 + 0.5 * np.log(2 * np.pi)
    return np.clip(odds, -strongest, strongest)


def likeliest_story(clues: Clues, settings: DetectionSettings) -> Story:
    """Viterbi's path through the joint states of all feet.

    Args:
        clues: the evidence.
        settings: costs of the states and of their changes.
    """
    feet = clues.loaded.shape[1]
    states = np.array([(*s, elsewhere) for s in product(Foot, repeat=feet) for elsewhere in (0, 1)])
    cost = np.column_stack([_cost(state, clues, settings) for state in states])
    change, loss = _change_costs(states, settings)
    path = _cheapest_path(cost / (settings.steady_s * clues.rate), change, loss, _edges(clues.loaded))
    return Story(feet=states[path, :feet], elsewhere=states[path, feet].astype(bool))


def _cost(
    state: Int[np.ndarray, " feet+1"], clues: Clues, settings: DetectionSettings
) -> Float[np.ndarray, " frames"]:
    """Of one joint state on each frame: minus its log likelihood."""
    cost = np.zeros(len(clues.missing))
    for f, foot in enumerate(state[:-1]):
        cost += clues.ground[:, f] * (0.5 if foot == Foot.UP else -0.5)
        if foot == Foot.LOST:
            cost += settings.partly_odds * clues.loaded[:, f]
        else:
            cost += settings.unloaded_cost * (clues.loaded[:, f] != (foot == Foot.MEASURED))
    lost = tuple(np.flatnonzero(state[:-1] == Foot.LOST).tolist())
    elsewhere = bool(state[-1])
    if elsewhere:
        cost += settings.elsewhere_odds - clues.missing
    elif lost:
        cost += clues.place[lost]
        cost -= np.where(clues.loaded[:, lost[0]], clues.partly[:, lost[0]], clues.missing) if len(lost)==1 else clues.missing
    return cost


def _change_costs(
    states: Int[np.ndarray, "states feet+1"], settings: DetectionSettings
) -> tuple[Float[np.ndarray, "states states"], Float[np.ndarray, "feet states states"]]:
    """Of going from a state (row) to another (column), and what each foot adds away from its load's edges."""
    before, after = states[:, None, :-1], states[None, :, :-1]
    changed = before != after
    into_or_out = changed & ((before == Foot.LOST) | (after == Foot.LOST))
    change = settings.touch_cost * into_or_out.sum(axis=2)
    change = change + settings.loss_cost * (states[:, None, -1] != states[None, :, -1])
    loss = into_or_out & ((before == Foot.MEASURED) | (after == Foot.MEASURED))
    return change, settings.loss_cost * np.moveaxis(loss, 2, 0).astype(float)


def _edges(loaded: Bool[np.ndarray, "frames feet"]) -> Bool[np.ndarray, "frames feet"]:
    """Frames on which a foot's plate is loaded or unloaded, against the frame before."""
    return np.diff(loaded, axis=0, prepend=loaded[:1])


def _cheapest_path(
    cost: Float[np.ndarray, "frames states"],
    change: Float[np.ndarray, "states states"],
    loss: Float[np.ndarray, "feet states states"],
    edges: Bool[np.ndarray, "frames feet"],
) -> Int[np.ndarray, " frames"]:
    frames, count = cost.shape
    changes = {
        key: change + sum(table for table, edge in zip(loss, key, strict=True) if not edge)
        for key in set(map(tuple, edges.tolist()))
    }
    total = cost[0].copy()
    origin = np.zeros((frames, count), dtype=int)
    for t in range(1, frames):
        through = total[:, None] + changes[tuple(edges[t].tolist())]
        origin[t] = through.argmin(axis=0)
        total = through.min(axis=0) + cost[t]
    path = np.empty(frames, dtype=int)
    path[-1] = total.argmin()
    for t in range(frames - 1, 0, -1):
        path[t - 1] = origin[t, path[t]]
    return path
