"""Whether markers are as far apart as their landmarks: weighs what labels may mean against each other.

Every pair of markers has a mean distance and, over time, a deviation from it. Every pair of landmarks has,
over postures of the default body, an expected distance and a scatter; pairs on one body stay together.
Each label holds probabilities over its candidates and "none of them". They are updated from those of the
others until they settle (mean field), the pairs' evidence being tempered, because pairs share markers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, Int

from solver.capture.capture import Markers
from solver.markers.atlas import atlas, landmark_marker
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.skeleton import Skeleton

FRAMES = 60  # of each recording, evenly
POSTURES = 200
REACH = 0.6  # of the joints' ranges: recordings rarely use all of them
SIZE_SCATTER = 0.08  # people's proportions against the tables'
ELSEWHERE_MEAN, ELSEWHERE_STD = 0.75, 0.40  # [m] distances between unrelated places of a body
MOVES_TOGETHER_M = 0.010  # deviation over time of a distance within a segment: soft tissue
MOVES_APART_M = 0.06  # likewise of markers on different segments of somebody who moves
# [log odds] least and most that one pair may tell: on one body, and elsewhere
ON_ONE_BODY, ELSEWHERE = (-8.0, 2.0), (-3.0, 2.0)
MOST_FROM_ELSEWHERE = 0.25  # that the label is right at all, whichever of its landmarks is meant
# [pairs] all pairs with the markers of one body tell as much as so many independent ones: the same, another
WORTH_OF_OWN_BODY, WORTH_OF_A_BODY = 4.0, 1.0
LIES_ALIKE_M = (
    0.04  # mean of differences between distances of a left and a right marker: placement, soft tissue
)
NAMED = 0.5  # least probability by the name alone of labels that tell the person's size, if most have it
ROUNDS = 30


@dataclass(frozen=True)
class Candidate:
    """A landmark that a label may mean."""

    landmark: str
    probability: float  # by the label alone
    family: str
    how: str


def weigh_distances(
    candidates: Mapping[str, Sequence[Candidate]],
    recordings: Sequence[Markers],
    counterparts: Mapping[str, str] | None = None,
) -> dict[str, dict[str, float]]:
    """Probabilities of each label's landmarks, after a look at the trajectories.

    Args:
        candidates: by label; their probabilities leave room for "none of them".
        recordings: that have these labels; none leaves the probabilities as they are.
        counterparts: labels of the other side. Two that lie alike on a body are right together or not at all.
    """
    labels = list(candidates)
    prior = {label: {c.landmark: c.probability for c in candidates[label]} for label in labels}
    measured = _measured(labels, recordings)
    if measured is None or not labels:
        return prior
    mean, deviation = measured
    owner = np.array([i for i, label in enumerate(labels) for _ in candidates[label]])
    landmark = np.array([_order()[c.landmark] for label in labels for c in candidates[label]])
    p = np.array([c.probability for label in labels for c in candidates[label]])
    none = np.array([max(1e-3, 1 - sum(prior[label].values())) for label in labels])
    first = np.array([np.flatnonzero(owner == i)[0] for i in range(len(labels))])
    named = p[first] >= NAMED
    named |= 2 * named.sum() < len(named)
    size = _size(mean[np.ix_(named, named)], landmark[first][named])
    evidence = _pair_evidence(mean / size, deviation, owner, landmark)
    body = _bodies()[landmark]
    together = body[:, None] == body[None, :]
    worth = np.where(together, WORTH_OF_OWN_BODY, WORTH_OF_A_BODY)
    modest = np.where(together, evidence, np.minimum(evidence, MOST_FROM_ELSEWHERE))
    log_p, log_none = np.log(np.maximum(p, 1e-4)), np.log(none)
    counterpart = _lying_alike(labels, counterparts or {}, mean, body[first])
    of_counterpart = (counterpart[owner][:, None] == owner) & (owner[:, None] != owner)
    belief = p.copy()
    for _ in range(ROUNDS):
        tempered = np.minimum(1.0, worth / np.maximum(np.bincount(body, belief)[body], 1e-6))
        share = _shares(log_p + (evidence * tempered) @ belief, owner)
        # if a label is right, its counterpart that lies alike is
        given_right = np.where(of_counterpart, share, belief)
        support = np.bincount(owner, share * (modest * tempered * given_right).sum(axis=1))
        odds = np.log(np.bincount(owner, p)) - log_none + support
        right = 1 / (1 + np.exp(-np.clip((odds + odds[counterpart]) / 2, -30, 30)))
        belief = 0.5 * belief + 0.5 * share * right[owner]
    found: dict[str, dict[str, float]] = {label: {} for label in labels}
    for i, k in enumerate(owner):
        found[labels[k]][candidates[labels[k]][i - first[k]].landmark] = float(belief[i])
    return found


def _lying_alike(
    labels: Sequence[str],
    counterparts: Mapping[str, str],
    mean: Float[np.ndarray, "labels labels"],
    body: Int[np.ndarray, " labels"],
) -> Int[np.ndarray, " labels"]:
    """Each label's counterpart, if its distances on its body mirror this one's; else itself."""
    index = {label: i for i, label in enumerate(labels)}
    other = np.array([index.get(counterparts.get(label, ""), i) for i, label in enumerate(labels)])
    found = np.arange(len(labels))
    for i, j in enumerate(other):
        own = np.arange(len(labels))
        there = (body == body[i]) & (own != i) & (own != j) & ((body[i] == body[j]) | (other != own))
        off = np.abs(mean[i, there] - mean[j, other[there]])
        if j != i and np.isfinite(off).any() and np.nanmean(off) < LIES_ALIKE_M:
            found[i] = j
    return found


def apart_m(one: str, other: str) -> float:
    """How far two landmarks usually are apart on the default body [m]."""
    mean, _ = _expected()
    return float(mean[_order()[one], _order()[other]])


def _shares(
    score: Float[np.ndarray, " candidates"], owner: Int[np.ndarray, " candidates"]
) -> Float[np.ndarray, " candidates"]:
    """Each candidate's share among those of its label, from log weights."""
    highest = np.full(owner.max() + 1, -np.inf)
    np.maximum.at(highest, owner, score)
    weight = np.exp(score - highest[owner])
    return weight / np.bincount(owner, weight)[owner]


def _measured(
    labels: Sequence[str], recordings: Sequence[Markers]
) -> tuple[Float[np.ndarray, "labels labels"], Float[np.ndarray, "labels labels"]] | None:
    """Mean distance [m] of each pair and its deviation over time [m]; NaN for pairs never seen together."""
    thinned = []
    for markers in recordings:
        frames = np.unique(np.linspace(0, markers.frames - 1, min(FRAMES, markers.frames)).astype(int))
        column = {name: i for i, name in enumerate(markers.names)}
        positions = np.full((len(frames), len(labels), 3), np.nan)
        for i, label in enumerate(labels):
            if label in column:
                positions[:, i] = markers.positions_ground[frames, column[label]]
        thinned.append(positions)
    if not thinned:
        return None
    x = np.concatenate(thinned)
    distance = np.linalg.norm(x[:, :, None] - x[:, None, :], axis=3)
    seen = np.isfinite(distance)
    count = seen.sum(axis=0)
    filled = np.where(seen, distance, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = filled.sum(axis=0) / count
        spread = np.where(seen, distance - mean, 0.0)
        deviation = np.sqrt((spread**2).sum(axis=0) / np.maximum(1, count - 1))
    mean[count < 2] = np.nan
    return mean, deviation


def _size(mean: Float[np.ndarray, "labels labels"], landmark: Int[np.ndarray, " labels"]) -> float:
    """The person's size against the default body's, by well-defined distances."""
    expected, scatter = (a[np.ix_(landmark, landmark)] for a in _expected())
    good = np.isfinite(mean) & (expected > 0.2) & (scatter < 0.12 * expected)
    if good.sum() < 6:
        good = np.isfinite(mean) & (expected > 0.2) & (scatter < 0.3 * expected)
    return float(np.clip(np.median(mean[good] / expected[good]), 0.4, 1.3)) if good.any() else 1.0


def _pair_evidence(
    mean: Float[np.ndarray, "labels labels"],
    deviation: Float[np.ndarray, "labels labels"],
    owner: Int[np.ndarray, " candidates"],
    landmark: Int[np.ndarray, " candidates"],
) -> Float[np.ndarray, "candidates candidates"]:
    """Log odds, for every two candidates of different labels, that both are right rather than unrelated."""
    expected, scatter = (a[np.ix_(landmark, landmark)] for a in _expected())
    body = _bodies()[landmark]
    together = body[:, None] == body[None, :]
    d, s = mean[np.ix_(owner, owner)], deviation[np.ix_(owner, owner)]
    std = np.sqrt(scatter**2 + (SIZE_SCATTER * expected) ** 2 + 0.01**2)
    near = -0.5 * ((d - expected) / std) ** 2 - np.log(std)
    elsewhere = -0.5 * ((d - ELSEWHERE_MEAN) / ELSEWHERE_STD) ** 2 - np.log(ELSEWHERE_STD)
    stays = np.log(MOVES_APART_M / MOVES_TOGETHER_M) - s * (1 / MOVES_TOGETHER_M - 1 / MOVES_APART_M)
    moving = np.nanmedian(s) > 2 * MOVES_TOGETHER_M
    total = near - elsewhere + np.where(together, np.minimum(stays, 1.0 if moving else 0.0), 0.0)
    total = np.where(together, np.clip(total, *ON_ONE_BODY), np.clip(total, *ELSEWHERE))
    return np.where(np.isfinite(total) & (owner[:, None] != owner[None, :]), total, 0.0)


def posture_scatter_m(one: str, other: str) -> float:
    """How far the distance of two landmarks of the default body scatters over postures [m]."""
    i, j = _order()[one], _order()[other]
    spread = [mark.spread_m for mark in atlas().values()]
    return float(np.sqrt(max(0.0, _expected()[1][i, j] ** 2 - spread[i] ** 2 - spread[j] ** 2)))


@cache
def _order() -> dict[str, int]:
    return {name: i for i, name in enumerate(atlas())}


@cache
def _bodies() -> Int[np.ndarray, " landmarks"]:
    """Body of each landmark, as a number; a kneecap and an ankle bone move with the shank nearly enough."""
    alias = {"patella": "tibia", "talus": "tibia"}
    names = []
    for mark in atlas().values():
        stem, _, side = mark.body.partition("_")
        names.append(f"{alias.get(stem, stem)}_{side}")
    return np.unique(names, return_inverse=True)[1]


@cache
def _expected() -> tuple[Float[np.ndarray, "landmarks landmarks"], Float[np.ndarray, "landmarks landmarks"]]:
    """Mean distance of every two landmarks over postures, and its scatter with that of their places [m]."""
    body = default_skeleton()
    marks = list(atlas().values())
    skeleton = body.with_markers([landmark_marker(mark, mark.name, body) for mark in marks])
    x = marker_positions(skeleton, _postures(skeleton))
    n = len(marks)
    total, squares = np.zeros((n, n)), np.zeros((n, n))
    for frame in x:
        square = (frame**2).sum(axis=1)
        apart = np.maximum(0.0, square[:, None] + square[None, :] - 2 * frame @ frame.T)
        total += np.sqrt(apart)
        squares += apart
    mean = total / len(x)
    spread = np.array([mark.spread_m for mark in marks])
    place = spread[:, None] ** 2 + spread[None, :] ** 2
    # two places that scatter by themselves are on the average further apart than their middles
    return np.sqrt(mean**2 + place), np.sqrt(np.maximum(0.0, squares / len(x) - mean**2) + place)


def _postures(skeleton: Skeleton) -> Float[np.ndarray, "postures dofs"]:
    """Postures between the default one and the joints' limits, the pelvis at rest."""
    rng = np.random.default_rng(0)
    rest = skeleton.default_q
    low, high = np.array([c.range for c in skeleton.free_coordinates]).T
    root = np.array([name.startswith("pelvis_") for name in skeleton.dofs])
    low, high = (np.where(root, rest, rest + REACH * (limit - rest)) for limit in (low, high))
    return rest + (np.where(rng.random((POSTURES, len(rest))) < 0.5, low, high) - rest) * rng.beta(
        1, 2, (POSTURES, len(rest))
    )
