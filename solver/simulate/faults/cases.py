"""Cases: a world with effects in it, simulated, measured and spoilt."""

from dataclasses import dataclass, replace

import numpy as np

from solver.simulate.faults.hidden import Hidden, Recording, Truth
from solver.simulate.faults.measurement_effects import MEASUREMENT, hide_measurement
from solver.simulate.faults.physical import PHYSICAL, UNKNOWN, hide_physical
from solver.simulate.faults.worlds import (
    Handout,
    ModelKind,
    World,
    WorldPlan,
    draw_handout,
    record,
    world_of,
)

IDS = (*MEASUREMENT, *PHYSICAL)
SIZES = (1.0, 1.5, 2.5)
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


def one_case(
    name: str,
    ids: tuple[str, ...],
    seed: int,
    *,
    world: WorldPlan,
    size: float = 1.0,
    model: ModelKind | None = None,
) -> CasePlan:
    """A case asked for by name, for tests."""
    rng = np.random.default_rng(seed)
    kind = "clean" if not ids else "unknown" if ids[0] in UNKNOWN else "single" if len(ids) == 1 else "pair"
    return CasePlan(name, kind, ids, (size,) * len(ids), world, draw_handout(rng, model), seed)


def _exact(effect: Hidden, world: World, recording: Recording) -> Hidden:
    """The entered mass is never exact: what counts is the true one over it."""
    if effect.id != "subject_mass" or recording.mass_kg is None:
        return effect
    return replace(effect, parameters={"mass_factor": float(world.body.skeleton.mass / recording.mass_kg)})
