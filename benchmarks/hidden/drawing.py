"""Which cases: the world first, in which nothing tells what will be hidden, then what is hidden in it."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.classes import CAUSES
from solver.simulate.faults.cases import IDS as HIDEABLE
from solver.simulate.faults.cases import (
    OVERGROUND_ONLY,
    SIZES,
    TREADMILL_ONLY,
    WALKING_ONLY,
    CasePlan,
)
from solver.simulate.faults.drawing import MEASUREMENT
from solver.simulate.faults.hidden import UNSIZED
from solver.simulate.faults.physical import UNKNOWN
from solver.simulate.faults.worlds import Handout, WorldPlan, draw_handout, plan_world

INSIDE, OUTSIDE, CLEAN = "inside", "outside", "clean"
OVERSIZES = (10.0, 30.0)  # reference sizes
SQUAT_SIZES = (2.5, 4.0)  # at the reference size hardly anything shows in a squat
SQUATS = 0.15  # share of the cases
IDS = tuple(i for i in HIDEABLE if i in CAUSES)  # another one would change every case of a seed
# Of these 10 or 30 reference sizes can be: forces and masses of that size would throw the person over, and a
# mass factor below zero is none.
OVERSIZED = tuple(i for i in MEASUREMENT if i in IDS and i not in UNSIZED and i != "subject_mass")


@dataclass(frozen=True)
class PublicCase:
    """A case before it is made, and the group that it belongs to."""

    group: str  # inside, outside, clean
    plan: CasePlan


def names_of(count: int) -> list[str]:
    """The cases' names."""
    return [f"case_{n:04d}" for n in range(count)]


def plan_public(seed: int, count: int) -> list[PublicCase]:
    """Draw a third with an effect of the catalogue, a third with one outside it, and the rest clean.

    Every case has a person and a trial of its own, so that no two cases can be compared.
    """
    worlds, order, effects = np.random.default_rng(seed).spawn(3)
    groups = [INSIDE] * (count // 3) + [OUTSIDE] * (count // 3)
    groups += [CLEAN] * (count - len(groups))
    shuffled = [groups[k] for k in order.permutation(count)]
    queues = {
        INSIDE: _queue([(i,) for i in IDS], effects),
        "unknown": _queue([(i,) for i in UNKNOWN], effects),
        "oversized": _queue([(i, size) for i in OVERSIZED for size in OVERSIZES], effects),
    }
    cases = []
    for name, group in zip(names_of(count), shuffled, strict=True):
        world, handout, case_seed = draw_setting(worlds)
        kind = group if group != OUTSIDE else ("unknown", "oversized")[int(effects.integers(2))]
        ids, sizes = _effect(kind, queues, world, effects)
        plan_kind = {INSIDE: "single", "oversized": "single", "unknown": "unknown", CLEAN: "clean"}[kind]
        plan = CasePlan(name, plan_kind, ids, sizes, world, handout, case_seed)
        cases.append(PublicCase(group, plan))
    return cases


def draw_setting(rng: np.random.Generator) -> tuple[WorldPlan, Handout, int]:
    """A person, what they do and what is handed out of it: drawn before it is known what is hidden."""
    activity = "squat" if rng.random() < SQUATS else "walk"
    return plan_world(rng, activity), draw_handout(rng), int(rng.integers(2**31))


def fits(id: str, world: WorldPlan) -> bool:
    """Whether an effect can be hidden in a world."""
    if id in OVERGROUND_ONLY:
        return world.layout == "overground"
    if id in TREADMILL_ONLY:
        return world.layout == "treadmill"
    return id not in WALKING_ONLY or world.activity == "walk"


def _effect(
    kind: str, queues: dict[str, deque], world: WorldPlan, rng: np.random.Generator
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    if kind == CLEAN:
        return (), ()
    queue = queues[kind]
    chosen = next(entry for entry in queue if fits(entry[0], world))
    queue.remove(chosen)
    queue.append(chosen)
    usual = SQUAT_SIZES if world.activity == "squat" else SIZES
    drawn = float(rng.choice(usual))
    size = chosen[1] if kind == "oversized" else 1.0 if chosen[0] in UNSIZED else drawn
    return (chosen[0],), (size,)


def _queue(entries: list[tuple], rng: np.random.Generator) -> deque:
    return deque(entries[k] for k in rng.permutation(len(entries)))
