"""Cases: worlds, effects and sizes drawn from one seed, written as folders with the truth beside them."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from solver.capture.atomic import write_whole
from solver.simulate.faults.drawing import MEASUREMENT, hide_measurement
from solver.simulate.faults.hidden import UNSIZED, Hidden, Recording, Truth, write_recording
from solver.simulate.faults.physical import PHYSICAL, UNKNOWN, hide_physical
from solver.simulate.faults.worlds import (
    Handout,
    ModelKind,
    World,
    WorldPlan,
    draw_handout,
    plan_world,
    record,
    world_of,
)

IDS = (*MEASUREMENT, *PHYSICAL)
SIZES = (1.0, 1.5, 2.5)
CLEAN_ACTIVITIES = ("walk",) * 14 + ("squat",) * 4 + ("stand",) * 2
TREADMILL_ONLY = (
    "elastic_tether",
    "belt_acceleration",
    "belt_slope",
    "plate_gain",
    "plate_bias",
    "plate_position",
    "plate_yaw",
)
OVERGROUND_ONLY = ("drag",)
WALKING_ONLY = (
    *OVERGROUND_ONLY,
    "off_plate_step",
    "marker_swap",
    "belt_acceleration",
    "elastic_tether",
    "belt_slope",
)
OF_THE_BODY = ("segment_mass", "wobbling_mass")  # in every trial of the person
# Two that say the same thing together, or of which one undoes the other, make no pair.
NO_PAIR = (
    {"clock_offset", "sample_rate"},
    {"clock_offset", "filter_mismatch"},
    {"sample_rate", "filter_mismatch"},
    {"plate_swap", "axis_convention"},
    {"subject_mass", "segment_mass"},
    {"subject_mass", "carried_mass"},
    {"subject_mass", "body_weight_support"},
    {"subject_mass", "plate_gain"},
)


@dataclass(frozen=True)
class CasePlan:
    """Everything that makes a case, before anything is simulated."""

    name: str
    kind: str  # clean, single, pair, unknown
    ids: tuple[str, ...]
    sizes: tuple[float, ...]
    world: WorldPlan
    handout: Handout
    seed: int


@dataclass(frozen=True)
class Mix:
    """How many cases of each kind."""

    clean: int
    single: int
    pair: int
    unknown: int

    @staticmethod
    def of(cases: int) -> "Mix":
        """Half of them clean, a third with one effect of the catalogue, the rest pairs and unknown ones."""
        clean, pair, unknown = cases // 2, cases // 12, cases // 12
        return Mix(clean, cases - clean - pair - unknown, pair, unknown)


def plan_cases(
    seed: int,
    mix: Mix,
    sizes: tuple[float, ...] = SIZES,
    ids: tuple[str, ...] = IDS,
    prefix: str = "case",
) -> list[CasePlan]:
    """Draw the cases of a benchmark; ids go round, so that each is hidden about equally often."""
    rng = np.random.default_rng(seed)
    pool = _Pool(rng.spawn(1)[0], share=2)
    kinds = ["clean"] * mix.clean + ["single"] * mix.single + ["pair"] * mix.pair + ["unknown"] * mix.unknown
    plans: list[CasePlan] = []
    turn, strange = _round(ids, rng), _round(tuple(UNKNOWN), rng)
    for kind in kinds:
        chosen: tuple[str, ...] = ()
        if kind == "single":
            chosen = (next(turn),)
        elif kind == "pair":
            chosen = _pair(rng, ids)
        elif kind == "unknown":
            chosen = (next(strange),)
        world = pool.world(chosen)
        drawn = tuple(1.0 if i in UNSIZED else float(rng.choice(sizes)) for i in chosen)
        plans.append(CasePlan("", kind, chosen, drawn, world, draw_handout(rng), int(rng.integers(2**31))))
    order = rng.permutation(len(plans))
    return [replace(plans[k], name=f"{prefix}_{n:04d}") for n, k in enumerate(order)]


def made(plan: CasePlan) -> tuple[Recording, Truth]:
    """Simulate, measure and spoil one case."""
    world = world_of(plan.world)
    rng = np.random.default_rng(plan.seed)
    worlds = (world, *world.others)
    trials, hidden = [w.trial for w in worlds], []
    for id, size in zip(plan.ids, plan.sizes, strict=True):
        if id not in PHYSICAL and id not in UNKNOWN:
            continue
        chosen = range(len(worlds)) if id in OF_THE_BODY else [int(rng.integers(len(worlds)))]
        seed = int(rng.integers(2**31))
        for k in chosen:
            trials[k], effect = hide_physical(worlds[k], id, size, np.random.default_rng(seed))
        if id not in OF_THE_BODY:
            effect = replace(effect, trial=worlds[chosen[0]].trial.scenario.name)
        hidden.append(effect)
    recording = record(world, trials, plan.handout)
    for id, size in zip(plan.ids, plan.sizes, strict=True):
        if id in MEASUREMENT:
            recording, effect = hide_measurement(recording, id, size, rng)
            hidden.append(_exact(effect, world, recording))
    about = {"world": plan.world.as_json(), "handout": plan.handout.as_json()}
    return recording, Truth(plan.name, plan.kind, tuple(hidden), about)


def write_case(out: Path, plan: CasePlan) -> None:
    """Write OUT/subjects/NAME, which the finder sees, and OUT/truth/NAME.json, which it doesn't."""
    recording, truth = made(plan)
    write_recording(out / "subjects" / plan.name, recording)
    write_truth(out, truth)


def write_truth(out: Path, truth: Truth) -> None:
    """Write OUT/truth/NAME.json."""
    (out / "truth").mkdir(parents=True, exist_ok=True)
    write_whole(out / "truth" / f"{truth.case}.json", json.dumps(truth.as_json(), indent=1) + "\n")


def one_case(
    name: str,
    ids: tuple[str, ...],
    seed: int,
    *,
    size: float = 1.0,
    model: ModelKind | None = None,
    world: WorldPlan | None = None,
) -> CasePlan:
    """A case asked for by name, for tests."""
    rng = np.random.default_rng(seed)
    kind = "clean" if not ids else "unknown" if ids[0] in UNKNOWN else "single" if len(ids) == 1 else "pair"
    plan = world or _Pool(rng, share=1).world(ids)
    return CasePlan(name, kind, ids, (size,) * len(ids), plan, draw_handout(rng, model), seed)


def _exact(effect: Hidden, world: World, recording: Recording) -> Hidden:
    """The entered mass is never exact: what counts is the true one over it."""
    if effect.id != "subject_mass" or recording.mass_kg is None:
        return effect
    return replace(effect, parameters={"mass_factor": float(world.body.skeleton.mass / recording.mass_kg)})


class _Pool:
    """Worlds by what they can hold; each serves `share` cases before the next is drawn."""

    def __init__(self, rng: np.random.Generator, share: int) -> None:
        self._rng, self._share = rng, share
        self._open: dict[tuple[str, str | None], tuple[WorldPlan, int]] = {}
        self._clean = _round(CLEAN_ACTIVITIES, rng)

    def world(self, ids: tuple[str, ...]) -> WorldPlan:
        """A world in which these effects can be hidden."""
        layout = None
        activity = "walk" if any(i in WALKING_ONLY for i in ids) or self._rng.random() < 0.85 else "squat"
        if any(i in OVERGROUND_ONLY for i in ids):
            layout, activity = "overground", "walk"
        elif any(i in TREADMILL_ONLY for i in ids):
            layout, activity = "treadmill", "walk"
        elif not ids:
            activity = next(self._clean)
        plan, used = self._open.get((activity, layout), (None, self._share))
        if plan is None or used >= self._share:
            plan, used = plan_world(self._rng, activity, layout), 0
        self._open[(activity, layout)] = (plan, used + 1)
        return plan


def _round(items: tuple[str, ...], rng: np.random.Generator) -> Iterator[str]:
    while True:
        yield from (items[k] for k in rng.permutation(len(items)))


def _pair(rng: np.random.Generator, ids: tuple[str, ...]) -> tuple[str, ...]:
    while True:
        one, two = (str(i) for i in rng.choice(np.array(ids), 2, replace=False))
        both = {one, two}
        apart = (both & set(OVERGROUND_ONLY)) and (both & set(TREADMILL_ONLY))
        both_physical = both <= set(PHYSICAL)
        if not apart and not both_physical and both not in NO_PAIR:
            return tuple(sorted(both, key=ids.index))


def summary(plan: CasePlan) -> dict[str, Any]:
    """One line about a case, for the maker's list."""
    return {"case": plan.name, "kind": plan.kind, "ids": plan.ids, "sizes": plan.sizes}
