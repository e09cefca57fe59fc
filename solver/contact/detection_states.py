"""The likeliest contact states: when each foot was up, measured, or on the ground with force missing.

Under which feet a missing force presses: the moments it leaves unbalanced tell where it acts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import combinations, product

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import log_ndtr

from solver.common.plate_figures import CONTACT_N
from solver.contact.detection_balance import UP
from solver.contact.detection_settings import STEADY_S
from solver.contact.detection_shares import Explained, WrenchBalance
from solver.contact.sole import Sole

POINT_NOISE_M = 0.04  # [m] of soles and centres of mass in the model
HALF_SOLE_M = 0.05  # [m] half a sole's width, round the line between two feet
LEAST_PRESSING_N = CONTACT_N  # [N] a smaller missing force has no centre of pressure to speak of
STRONGEST_PLACE = 4.0  # log odds that one moment's place can give
ELSEWHERE_ODDS = 3.0  # log odds against a chair or a hand, before anything is known: plates are for feet
PARTLY_ODDS = 0.5  # log odds against a loaded foot's force being wrong, before anything is known
TOUCH_COST = 1.5  # of a contact's begin or end: no contact lasts 20 ms
LOSS_COST = 6.0  # of a force that is lost or comes back while the plate stays loaded: rare
UNLOADED_COST = 30.0  # of calling a foot measured while its plate is unloaded, or up while it is loaded

Feet = tuple[int, ...]


def place_costs(
    slow: WrenchBalance,
    explained: Explained,
    outlines: Sequence[Sole],
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
) -> dict[Feet, Float[np.ndarray, " frames"]]:
    """For every set of feet that may miss force: minus the log likelihood of the place where it presses.

    Half the squared distance from the soles, in standard deviations: the smaller the missing force, the less
    its place is known. Between two feet is as good as under one. Nothing missing: no cost.

    Args:
        slow: required and measured wrenches.
        explained: what of their difference is known.
        outlines: of the soles.
        poses: orientations and origins of all bodies.
    """
    missing = slow.missing(explained)
    spread = np.hypot(
        POINT_NOISE_M,
        explained.moment_noise * slow.body.moment_noise / np.maximum(missing[:, UP], LEAST_PRESSING_N),
    )
    pressing = missing[:, UP] > LEAST_PRESSING_N
    points, offsets = [], []
    for sole in outlines:
        corners = sole.corners_ground(*poses)
        ground = corners[..., UP].min(axis=1)
        point = slow.body.pressed_point(missing, ground)
        points.append(np.insert(point, UP, ground, axis=1))
        offsets.append(corners[..., [0, 2]].mean(axis=1))
    far = [s.distance(*poses, p) for s, p in zip(outlines, points, strict=True)]
    costs = {}
    for count in range(1, len(outlines) + 1):
        for feet in combinations(range(len(outlines)), count):
            distance = np.min([far[f] for f in feet], axis=0)
            for a, b in combinations(feet, 2):
                between = _from_segment(points[a][:, [0, 2]], offsets[a], offsets[b])
                distance = np.minimum(distance, np.maximum(0.0, between - HALF_SOLE_M))
            cost = np.minimum(0.5 * (distance / spread) ** 2, STRONGEST_PLACE)
            costs[feet] = np.where(pressing, cost, 0.0)
    return costs


def _from_segment(
    point: Float[np.ndarray, "frames 2"], a: Float[np.ndarray, "frames 2"], b: Float[np.ndarray, "frames 2"]
) -> Float[np.ndarray, " frames"]:
    along = b - a
    length = np.maximum(np.sum(along**2, axis=1), 1e-9)
    share = np.clip(np.sum((point - a) * along, axis=1) / length, 0.0, 1.0)
    return np.linalg.norm(point - a - share[:, None] * along, axis=1)


class Foot(IntEnum):
    """What one foot does."""

    UP = 0
    MEASURED = 1
    LOST = 2  # on the ground, its force not measured or not all of it


@dataclass(frozen=True)
class FrameEvidence:
    """What speaks for and against each state, frame by frame: natural logarithms of odds."""

    missing: Float[np.ndarray, " frames"]  # that some force is missing, whichever
    partly: Float[np.ndarray, "frames feet"]  # that a part of this loaded foot's force is
    ground: Float[np.ndarray, "frames feet"]  # that the foot stands, from its motion
    place: Mapping[Feet, Float[np.ndarray, " frames"]]  # against these feet, from where the force presses
    loaded: Bool[np.ndarray, "frames feet"]  # a plate carries the foot
    rate: float  # [Hz]


@dataclass(frozen=True)
class ContactStates:
    """The likeliest sequence of states."""

    feet: Int[np.ndarray, "frames feet"]  # of `Foot`
    elsewhere: Bool[np.ndarray, " frames"]  # something else than a foot carries a part of the body

    @property
    def lost(self) -> Bool[np.ndarray, "frames feet"]:
        """Feet whose force is missing or incomplete."""
        return self.feet == Foot.LOST


def missing_odds(
    missing: Float[np.ndarray, " frames"],
    error: Float[np.ndarray, " frames"],
    least: Float[np.ndarray, " frames"],
    most: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, " frames"]:
    """Natural log odds of 'a force between least and most is missing' against 'none is'.

    Without missing force the balance is N(0, σ²); with, it is any of these forces alike, plus the same error.

    Args:
        missing: from the balance [N].
        error: σ [N].
        least: [N].
        most: [N], greater.
    """
    z, low, high = missing / error, least / error, most / error
    above, beyond = log_ndtr(z - low), log_ndtr(z - high)
    within = above + np.log1p(-np.exp(np.minimum(beyond - above, -1e-9)))
    return within - np.log(high - low) + 0.5 * z**2 + 0.5 * np.log(2 * np.pi)


def likeliest_contact_states(frame_evidence: FrameEvidence) -> ContactStates:
    """Viterbi's path through the joint states of all feet.

    Args:
        frame_evidence: the evidence.
    """
    feet = frame_evidence.loaded.shape[1]
    states = np.array([(*s, elsewhere) for s in product(Foot, repeat=feet) for elsewhere in (0, 1)])
    cost = np.column_stack([_cost(state, frame_evidence) for state in states])
    change, loss = _change_costs(states)
    edges = np.diff(frame_evidence.loaded, axis=0, prepend=frame_evidence.loaded[:1])
    path = _cheapest_path(cost / (STEADY_S * frame_evidence.rate), change, loss, edges)
    return ContactStates(feet=states[path, :feet], elsewhere=states[path, feet].astype(bool))


def _cost(state: Int[np.ndarray, " feet+1"], frame_evidence: FrameEvidence) -> Float[np.ndarray, " frames"]:
    """Of one joint state on each frame: minus its log likelihood."""
    feet, elsewhere = state[:-1], bool(state[-1])
    cost = np.zeros(len(frame_evidence.missing))
    for f, foot in enumerate(feet):
        standing = 0.5 * frame_evidence.ground[:, f]
        if elsewhere:  # feet in front of a chair rest on the ground without carrying anything
            cost -= np.abs(standing)
        else:
            cost += standing if foot == Foot.UP else -standing
        if foot == Foot.LOST:
            cost += PARTLY_ODDS * frame_evidence.loaded[:, f]
        else:
            cost += UNLOADED_COST * (frame_evidence.loaded[:, f] != (foot == Foot.MEASURED))
    lost = tuple(np.flatnonzero(feet == Foot.LOST).tolist())
    if elsewhere:
        return cost + ELSEWHERE_ODDS - frame_evidence.missing
    if len(lost) == 1:
        alone = frame_evidence.loaded[:, lost[0]]
        return (
            cost
            + frame_evidence.place[lost]
            - np.where(alone, frame_evidence.partly[:, lost[0]], frame_evidence.missing)
        )
    return cost + frame_evidence.place[lost] - frame_evidence.missing if lost else cost


def _change_costs(
    states: Int[np.ndarray, "states feet+1"],
) -> tuple[Float[np.ndarray, "states states"], Float[np.ndarray, "feet states states"]]:
    """Of going from a state (row) to another (column), and what each foot adds away from its load's edges."""
    before, after = states[:, None, :-1], states[None, :, :-1]
    into_or_out = (before != after) & ((before == Foot.LOST) | (after == Foot.LOST))
    change = TOUCH_COST * into_or_out.sum(axis=2)
    change = change + LOSS_COST * (states[:, None, -1] != states[None, :, -1])
    loss = into_or_out & ((before == Foot.MEASURED) | (after == Foot.MEASURED))
    return change, LOSS_COST * np.moveaxis(loss, 2, 0).astype(float)


def _cheapest_path(
    cost: Float[np.ndarray, "frames states"],
    change: Float[np.ndarray, "states states"],
    loss: Float[np.ndarray, "feet states states"],
    edges: Bool[np.ndarray, "frames feet"],
) -> Int[np.ndarray, " frames"]:
    frames, count = cost.shape
    keys = [tuple(row) for row in edges.tolist()]
    changes = {key: change + loss[~np.array(key)].sum(axis=0) for key in set(keys)}
    total = cost[0].copy()
    origin = np.zeros((frames, count), dtype=int)
    for t in range(1, frames):
        through = total[:, None] + changes[keys[t]]
        origin[t] = through.argmin(axis=0)
        total = through.min(axis=0) + cost[t]
    path = np.empty(frames, dtype=int)
    path[-1] = total.argmin()
    for t in range(frames - 1, 0, -1):
        path[t - 1] = origin[t, path[t]]
    return path
