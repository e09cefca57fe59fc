"""Which cases there are, and how they become files: what everybody sees, and the truth in another place.

The world is drawn first, in which nothing tells what will be hidden, then what is hidden in it.
"""

import json
import os
import shutil
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.hidden.format import CAUSES, NONE, SOMETHING_ELSE, kept_salts, write_listing
from solver.capture.atomic import write_whole
from solver.capture.capture import Capture
from solver.simulate.faults.cases import IDS as HIDEABLE
from solver.simulate.faults.cases import OVERGROUND_ONLY, SIZES, TREADMILL_ONLY, WALKING_ONLY, CasePlan, made
from solver.simulate.faults.hidden import UNSIZED, Hidden, Recording, Truth, write_recording
from solver.simulate.faults.measurement_effects import MEASUREMENT, NoPlaceError
from solver.simulate.faults.physical import UNKNOWN
from solver.simulate.faults.worlds import Handout, WorldPlan, draw_handout, plan_world
from solver.skeleton.forward import cross

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


HELD_OUT_FROM = 0.8  # share of the frames after which the forces are not handed out
LEAST_SEEN = 0.5  # of an event's frames that lie before
TRIES = 4  # at another place, before another effect is hidden
FILE_TIME_S = 946684800  # 1 January 2000, of every file
SEEN_IN_FORCES = ("off_plate_step", "external_contact")


@dataclass(frozen=True)
class MadeCase:
    """What is handed out, and what is kept."""

    recording: Recording
    truth: dict[str, Any]


def make(out: Path, truth: Path, count: int, seed: int) -> None:
    """Write OUT/NAME, TRUTH/NAME.json and OUT/cases.json; cases that are there already stay."""
    names = names_of(count)
    salts = kept_salts(truth, names)
    for case in plan_public(salts.seed(seed), count):
        kept = truth / f"{case.plan.name}.json"
        if kept.exists():
            continue
        folder = out / case.plan.name
        shutil.rmtree(folder, ignore_errors=True)
        done = made_case(case)
        write_recording(folder, done.recording)
        set_file_times(folder)
        write_whole(kept, json.dumps(done.truth) + "\n")
    write_listing(out, truth, names)


def made_case(case: PublicCase) -> MadeCase:
    """Simulate, measure, spoil and cut one case; another place or effect where this one finds none."""
    for plan in _attempts(case):
        try:
            recording, truth = made(plan)
        except NoPlaceError:
            continue
        if all(_is_seen(effect, recording) for effect in truth.effects):
            return MadeCase(cut(recording), _truth_of(case.group, truth, recording))
    raise NoPlaceError(f"{case.plan.name}: no effect finds a place in this recording; choose another seed.")


def cut(recording: Recording) -> Recording:
    """The recording without the forces of its last fifth; its markers stay."""
    return replace(recording, trials=tuple(_cut(trial) for trial in recording.trials))


def first_held_out(trial: Capture) -> int:
    """The first marker frame whose forces are not handed out."""
    return int(np.ceil(HELD_OUT_FROM * trial.markers.frames))


def total_wrench(trial: Capture, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 6"]:
    """What all plates read together: force [N], moment about the ground origin [N·m]; NaN after their end."""
    total = np.zeros((len(times), 6))
    for plate in trial.plates:
        read = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
        for column in range(6):
            total[:, column] += np.interp(times, plate.times, read[:, column], left=np.nan, right=np.nan)
    return total


def set_file_times(folder: Path) -> None:
    """Give every file the same time, since the order in which they were made is nobody's business."""
    for path in (*folder.rglob("*"), folder):
        os.utime(path, (FILE_TIME_S, FILE_TIME_S))


def _attempts(case: PublicCase) -> Iterator[CasePlan]:
    plan = case.plan
    if case.group == CLEAN:
        yield plan
        return
    others = [i for i in IDS if i not in plan.ids and fits(i, plan.world)] if case.group == INSIDE else []
    for id in (*plan.ids, *others):
        for k in range(TRIES):
            yield replace(plan, ids=(id,), seed=plan.seed + k)


def _is_seen(effect: Hidden, recording: Recording) -> bool:
    """Whether an event in the forces lies where forces are handed out, for the most part."""
    if effect.id not in SEEN_IN_FORCES:
        return True
    trial = next(t for t in recording.trials if t.name == effect.trial)
    frames = np.concatenate([np.arange(a, b) for a, b in effect.frames])
    return float(np.mean(frames < first_held_out(trial))) >= LEAST_SEEN


def _cut(trial: Capture) -> Capture:
    until = trial.markers.times[first_held_out(trial)]
    plates = []
    for plate in trial.plates:
        kept = int(np.searchsorted(plate.times, until - 1e-9))
        plates.append(
            replace(
                plate,
                force_ground=plate.force_ground[:kept],
                moment_ground=plate.moment_ground[:kept],
                cop_ground=plate.cop_ground[:kept],
            )
        )
    return replace(trial, plates=tuple(plates))


def _truth_of(group: str, truth: Truth, recording: Recording) -> dict[str, Any]:
    """The truth's file: which answers are right, what was hidden, and the forces that were held out."""
    return {
        "case": truth.case,
        "group": group,
        "accepted": _accepted(group, truth),
        "effects": [effect.as_json() for effect in truth.effects],
        "held_out": {trial.name: _held_out(trial) for trial in recording.trials},
        **truth.world,
    }


def _accepted(group: str, truth: Truth) -> list[str]:
    """A cause of thirty reference sizes is still that cause, and also nothing that the list allows for."""
    own = [effect.id for effect in truth.effects if effect.id in IDS]
    return {CLEAN: [NONE], INSIDE: own, OUTSIDE: [*own, SOMETHING_ELSE]}[group]


def _held_out(trial: Capture) -> dict[str, Any]:
    """What the plates read on the held-out frames; moments about a point amid the markers of each frame."""
    frames = np.arange(first_held_out(trial), trial.markers.frames)
    about = np.nanmean(trial.markers.positions_ground[frames], axis=1)
    read = total_wrench(trial, trial.markers.times[frames])
    moment = read[:, 3:] - cross(about, read[:, :3])
    there = np.isfinite(read).all(axis=1)
    return {
        "first_frame": int(frames[0]),
        "frames": len(frames),
        "scored": np.flatnonzero(there).tolist(),
        "about_m": about.round(5).tolist(),
        "force_N": np.where(there[:, None], read[:, :3], 0.0).round(3).tolist(),
        "moment_Nm": np.where(there[:, None], moment, 0.0).round(3).tolist(),
    }
