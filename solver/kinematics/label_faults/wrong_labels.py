"""Stretches on which labels are wrong, and whose trajectory each is on there.

Two labels exchanged for a while: each keeps its distances only on the other's trajectory.

A label that for a while lies on another trajectory or on a ghost, while its neighbours stay together.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from solver.kinematics.label_faults.rigid_neighbours import (
    NORMAL,
    RIGHT,
    UNCLEAR,
    UNKNOWN,
    WRONG,
    RigidNeighbours,
    Stretch,
    edges,
    step_m,
    stretches,
)
from solver.kinematics.label_faults.settings import (
    CLEAR_SHARE,
    EXCHANGED_BACK_SHARE,
    FEWEST_FRAMES,
    LOOSEST_HOLD_M,
    RIGID_M,
)

EXCHANGED_M = 0.012  # [m] recorded labels must be off by more; markers nearer than that matter little
REPAIRED_SHARE = 0.25  # likewise in the median over the stretch: real exchanges reach 0.02 to 0.2
CRASH_M = 0.04  # [m] off its segment; soft tissue and loose markers stay below in running and landing
SAME_PLACE_M = 0.01  # [m] two labels this near are on one trajectory; markers are 9-25 mm across
APART_M = 0.03  # [m] markers usually nearer than that may well meet

ROUNDING_M = 1e-3  # distances agree no better than that

Pair = tuple[int, int]


@dataclass(frozen=True)
class Exchanged:
    """A pair of markers, by column, on frames start to end − 1."""

    pair: Pair
    start: int
    end: int
    off_m: float  # distances against the usual ones, as recorded, median over the frames
    repaired_off_m: float
    neighbours: int  # of both together
    named_right: bool  # outside these frames; False: most of the trial may have the wrong names


def exchanged_back(
    points_ground: Float[np.ndarray, "frames markers 3"], pair: Pair, start: int, end: int
) -> Float[np.ndarray, "frames markers 3"]:
    """The points with two columns exchanged on frames start to end − 1."""
    a, b = pair
    exchanged = points_ground.copy()
    exchanged[start:end, [a, b]] = points_ground[start:end, [b, a]]
    return exchanged


def exchanged_pairs(
    rigid: RigidNeighbours, elsewhere_m: Float[np.ndarray, "markers markers"], rate: float
) -> tuple[Exchanged, ...]:
    """All exchanges of a trial, the clearest first; each is looked for among what those before it left.

    One distance each tells enough here: two are to change at once, and to hold on the other's trajectory.

    Args:
        rigid: the trial's markers and the distances that they keep.
        elsewhere_m: distances in other recordings or on the model [m], NaN where unknown. They tell whether
            most of the trial has the names right; where not, neither the pair nor what is beside it is
            touched.
        rate: [Hz].
    """
    rigid = replace(rigid, fewest_neighbours=1)
    found: list[Exchanged] = []
    left: set[int] = set()
    while True:
        free = (c for c in _candidates(rigid, elsewhere_m, rate) if left.isdisjoint(c.pair))
        more = max(free, key=_clearness, default=None)
        if more is None:
            return tuple(found)
        found.append(more)
        if more.named_right:
            exchanged = exchanged_back(rigid.points_ground, more.pair, more.start, more.end)
            rigid = replace(rigid, points_ground=exchanged)
        else:
            left |= {*more.pair, *rigid.of(more.pair[0]).tolist(), *rigid.of(more.pair[1]).tolist()}


def _clearness(found: Exchanged) -> float:
    """How much better the distances hold once exchanged back, over how long."""
    return float(np.log(found.off_m / max(found.repaired_off_m, ROUNDING_M))) * (found.end - found.start)


def _candidates(
    rigid: RigidNeighbours, elsewhere_m: Float[np.ndarray, "markers markers"], rate: float
) -> Iterator[Exchanged]:
    usable = [m for m in range(len(rigid.usual_m)) if len(rigid.of(m))]
    astray = np.zeros(rigid.seen.shape, dtype=bool)
    for m in usable:
        astray[:, m] = rigid.off_m(m, rigid.points_ground[:, m], trust=False)[0] > EXCHANGED_M / 2
    for pair in combinations(usable, 2):
        frames = np.flatnonzero(astray[:, pair].all(axis=1))
        if _may_be_exchanged(rigid, pair, frames):
            yield from _of_pair(rigid, pair, _named_right(rigid, pair, elsewhere_m), rate)


def _may_be_exchanged(rigid: RigidNeighbours, pair: Pair, frames: Int[np.ndarray, " some"]) -> bool:
    """A quick look at the frames on which both are astray."""
    if len(frames) < FEWEST_FRAMES:
        return False
    there = replace(rigid, points_ground=rigid.points_ground[frames])
    kept, swapped = (_off_m(there, pair, places, trust=False)[0] for places in (pair, pair[::-1]))
    return bool((swapped < EXCHANGED_BACK_SHARE * kept).sum() >= FEWEST_FRAMES)


def _named_right(
    rigid: RigidNeighbours, pair: Pair, elsewhere_m: Float[np.ndarray, "markers markers"]
) -> bool:
    """Whether what holds for most frames is not what the other name should have."""
    own, other = rigid.usual_m[list(pair)], elsewhere_m[list(pair)]
    named, crossed = (np.delete(np.abs(own - o), pair, axis=1) for o in (other, other[::-1]))
    both = np.isfinite(named) & np.isfinite(crossed)
    return bool((named[both] ** 2).sum() <= (crossed[both] ** 2).sum())


def _of_pair(rigid: RigidNeighbours, pair: Pair, named_right: bool, rate: float) -> Iterator[Exchanged]:
    kept, known = _off_m(rigid, pair, pair)
    swapped, _ = _off_m(rigid, pair, pair[::-1])
    both = rigid.seen[:, pair].all(axis=1) & np.isfinite(kept + swapped)
    for stretch in stretches(_states(rigid, pair, kept, swapped), kept, rate, rigid.longest_gap_s):
        if not _changes_trajectories(rigid, pair, stretch, rate):
            continue
        start, end = _to_the_step(stretch, swapped < kept)
        frames = np.flatnonzero(both[start:end]) + start
        if len(frames) < FEWEST_FRAMES:
            continue
        off, repaired = float(np.median(kept[frames])), float(np.median(swapped[frames]))
        if repaired < REPAIRED_SHARE * off:
            neighbours = int(np.median(known[frames]))
            yield Exchanged(pair, start, end, off, repaired, neighbours, named_right)


def _changes_trajectories(rigid: RigidNeighbours, pair: Pair, stretch: Stretch, rate: float) -> bool:
    """Whether each label of a pair goes on where the other was, at both ends of a stretch."""
    a, b = pair
    for frames in edges(rigid, pair, stretch, rate):
        if frames is None:
            return False
        kept, crossed = (
            sum(step_m(rigid, places, frames, pair) for places in both)
            for both in (((a, a), (b, b)), ((a, b), (b, a)))
        )
        if crossed > EXCHANGED_BACK_SHARE * kept:
            return False
    return True


def _to_the_step(stretch: Stretch, better: Bool[np.ndarray, " frames"]) -> tuple[int, int]:
    """The stretch with frames at its ends that are not clearly wrong, but nearer to it than to right."""
    start, end = stretch.start, stretch.end
    while start > 0 and better[start - 1]:
        start -= 1
    while end < len(better) and better[end]:
        end += 1
    return start, end


def _off_m(
    rigid: RigidNeighbours, pair: Pair, places: Pair, *, trust: bool = True
) -> tuple[Float[np.ndarray, " frames"], Int[np.ndarray, " frames"]]:
    """How far distances are off with the pair on these columns' trajectories [m], and how many are known.

    The larger of both; that of one where the other is not known.
    """
    (off_a, known_a), (off_b, known_b) = (
        rigid.off_m(m, rigid.points_ground[:, place], without=pair, trust=trust)
        for m, place in zip(pair, places, strict=True)
    )
    return np.fmax(off_a, off_b), known_a + known_b


def _states(
    rigid: RigidNeighbours,
    pair: Pair,
    kept: Float[np.ndarray, " frames"],
    swapped: Float[np.ndarray, " frames"],
) -> Int8[np.ndarray, " frames"]:
    """Of every frame, whether the labels are right, exchanged, or neither clearly."""
    hold = rigid.hold_m[list(pair)].max()
    with np.errstate(invalid="ignore"):
        wrong = (swapped < EXCHANGED_BACK_SHARE * kept) & (kept > EXCHANGED_M) & (swapped < hold)
        right = (kept < EXCHANGED_BACK_SHARE * swapped) | ((kept < hold) & (kept < swapped))
    state = np.where(wrong, WRONG, np.where(right, RIGHT, UNCLEAR)).astype(np.int8)
    state[~np.isfinite(kept + swapped)] = UNKNOWN
    return state


@dataclass(frozen=True)
class Crashed:
    """A marker, by column, on frames start to end − 1."""

    marker: int
    start: int
    end: int
    off_m: float  # distances against the usual ones, median over the frames
    neighbours: int
    onto: int | None  # column of `trajectories_ground` that it lay on


def crashed_labels(
    rigid: RigidNeighbours,
    trajectories_ground: Float[np.ndarray, "frames trajectories 3"],
    own: tuple[int, ...],
    rate: float,
) -> tuple[Crashed, ...]:
    """All labels of a trial that leave their segment for a while.

    Args:
        rigid: the trial's markers and the distances that they keep.
        trajectories_ground: of all labels, those that are no marker of the model as well [m].
        own: for each marker of `rigid` its column there.
        rate: [Hz].
    """
    found: list[Crashed] = []
    while True:
        more = max(
            _crash_candidates(rigid, trajectories_ground, own, rate), key=_crash_clearness, default=None
        )
        if more is None:
            return tuple(found)
        found.append(more)
        points, trajectories_ground = rigid.points_ground.copy(), trajectories_ground.copy()
        points[more.start : more.end, more.marker] = np.nan
        trajectories_ground[more.start : more.end, own[more.marker]] = np.nan
        rigid = replace(rigid, points_ground=points)


def _crash_clearness(found: Crashed) -> float:
    return found.off_m * (found.end - found.start)


def _crash_candidates(
    rigid: RigidNeighbours,
    trajectories_ground: Float[np.ndarray, "frames trajectories 3"],
    own: tuple[int, ...],
    rate: float,
) -> Iterator[Crashed]:
    off = [rigid.off_m(m, rigid.points_ground[:, m]) for m in range(len(own))]
    for m, (off_m, known) in enumerate(off):
        if (off_m > LOOSEST_HOLD_M).sum() < FEWEST_FRAMES:
            continue
        met = _met(rigid, m, trajectories_ground, own)
        for stretch in _of_label(rigid, m, off_m, np.any(met, axis=1), rate):
            frames = np.arange(stretch.start, stretch.end)
            onto = met[frames].sum(axis=0)
            yield Crashed(
                m,
                stretch.start if stretch.after_right is None else stretch.after_right + 1,
                stretch.end if stretch.before_right is None else stretch.before_right,
                float(np.nanmedian(off_m[frames])),
                int(np.median(known[frames])),
                int(onto.argmax()) if 2 * onto.max() > len(frames) else None,
            )


def _met(
    rigid: RigidNeighbours,
    marker: int,
    trajectories_ground: Float[np.ndarray, "frames trajectories 3"],
    own: tuple[int, ...],
) -> Bool[np.ndarray, "frames trajectories"]:
    """Where a label lies on another trajectory, usually apart from it, that keeps its own distances."""
    column = own[marker]
    distance = np.linalg.norm(trajectories_ground - trajectories_ground[:, column, None], axis=2)
    with np.errstate(invalid="ignore"):
        met = distance < SAME_PLACE_M
    met[:, column] = False
    for k in np.flatnonzero(met.any(axis=0)):
        met[:, k] &= np.median(distance[np.isfinite(distance[:, k]), k]) > APART_M
        if k in own:
            other = own.index(k)
            off_m, _ = rigid.off_m(other, rigid.points_ground[:, other], without=(marker,))
            with np.errstate(invalid="ignore"):
                met[:, k] &= ~(off_m > rigid.hold_m[other])
    return met


def _of_label(
    rigid: RigidNeighbours,
    m: int,
    off_m: Float[np.ndarray, " frames"],
    met: Bool[np.ndarray, " frames"],
    rate: float,
) -> Iterator[Stretch]:
    deviation = rigid.deviation_m(m, rigid.points_ground[:, m])
    known = np.isfinite(deviation).sum(axis=1)
    with np.errstate(invalid="ignore"):
        most = 2 * (np.abs(deviation) > rigid.hold_m[m]).sum(axis=1) > known
        wrong = (off_m > CRASH_M) | (met & (off_m > LOOSEST_HOLD_M))
        state = np.where(wrong & most, WRONG, np.where(off_m < rigid.hold_m[m], RIGHT, UNCLEAR)).astype(
            np.int8
        )
    state[~np.isfinite(off_m)] = UNKNOWN
    for stretch in stretches(state, off_m, rate, rigid.longest_gap_s):
        frames = slice(stretch.start, stretch.end)
        returns = stretch.after_right is not None and stretch.before_right is not None
        if not _leaves(rigid, m, stretch, rate):
            continue
        if returns or met[frames].mean() > CLEAR_SHARE or _wanders(rigid, m, frames):
            yield stretch


def _leaves(rigid: RigidNeighbours, m: int, stretch: Stretch, rate: float) -> bool:
    """Whether it is the label that moves at both ends of a stretch, and not its neighbours."""
    across = edges(rigid, (m,), stretch, rate)
    least = LOOSEST_HOLD_M
    return all(frames is not None and step_m(rigid, (m, m), frames) > least for frames in across)


def _wanders(rigid: RigidNeighbours, m: int, frames: slice) -> bool:
    """Whether the distances to most neighbours vary: a marker that slipped keeps its new ones."""
    near, x = rigid.of(m), rigid.points_ground[frames]
    distance = np.linalg.norm(x[:, near] - x[:, m, None], axis=2)
    varies = []
    for column in distance.T:
        known = column[np.isfinite(column)]
        if len(known) >= FEWEST_FRAMES:
            varies.append(NORMAL * np.median(np.abs(known - np.median(known))) > RIGID_M)
    return bool(varies) and 2 * sum(varies) > len(varies)
