"""Synthetic people who walk, run, sprint, squat, stand and land, on floor and belt."""

from collections.abc import Container, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.activities.examples import SIMULATED, Example
from solver.common.gravity import GRAVITY
from solver.gait.activity import Activity, Kind
from solver.kinematics.motion import Motion
from solver.simulate.person import Person, TrueBody, body_of
from solver.simulate.treadmill import belt_under, on_treadmill
from solver.simulate.trial import GRID, Scenario, simulate_trial
from solver.skeleton.pinocchio_model import RigidBodyModel

FEET = ("calcn_r", "calcn_l")
TAUGHT, JUDGED = tuple(range(6)), tuple(range(100, 103))  # seeds of persons: no person is in both
SLOW_TO_MAKE = {0: ("landing", "sprint"), 102: ("landing",)}
WHAT = {
    "walk": (Activity.WALKING, Kind.OVERGROUND),
    "run": (Activity.RUNNING, Kind.OVERGROUND),
    "sprint": (Activity.RUNNING, Kind.OVERGROUND),
    "squat": (Activity.SQUAT, None),
    "stand": (Activity.STANDING, Kind.BOTH_FEET),
    "landing": (Activity.JUMP, Kind.DROP_JUMP),
}
EVERYTHING = frozenset(WHAT)
Between = tuple[float, float]
ADULTS: tuple[Between, Between] = (1.50, 1.92), (19.5, 29.0)  # heights [m] and body mass indices [kg/m²]
DURATION_S = {"walk": 4.0, "run": 1.6, "sprint": 0.8, "squat": 4.0, "stand": 4.0, "landing": 1.5}


def simulated(
    seeds: tuple[int, ...], folder: Path, activities: Container[str] = EVERYTHING
) -> Iterator[Example]:
    """What these persons do; motions are kept in a folder, since some take a minute to make.

    Args:
        seeds: of the persons.
        folder: made if it does not exist.
        activities: as scenarios call them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        body = somebody(rng)
        for scenario in _scenarios(seed, rng):
            if scenario.activity in activities:
                yield from _examples(seed, scenario, body, folder)


def somebody(rng: np.random.Generator, among: tuple[Between, Between] = ADULTS) -> TrueBody:
    """One of some people.

    Args:
        rng: who.
        among: their heights [m] and body mass indices [kg/m²].
    """
    height = float(rng.uniform(*among[0]))
    mass = float(rng.uniform(*among[1])) * height**2
    return body_of(Person(mass, height, "female" if rng.random() < 0.5 else "male"), rng)


def load_of(model: RigidBodyModel, motion: Motion) -> Float[np.ndarray, " frames"]:
    """What the ground bears [body weights]."""
    rise = model.centre_of_mass_acceleration(motion.q, motion.velocity, motion.acceleration)[:, 1]
    return np.asarray(1 + rise / GRAVITY)


def _scenarios(seed: int, rng: np.random.Generator) -> list[Scenario]:
    speeds = {
        "slow walk": ("walk", float(rng.uniform(0.7, 1.2))),
        "fast walk": ("walk", float(rng.uniform(1.2, 2.0))),
        "run": ("run", float(rng.uniform(2.3, 4.2))),
        "squat": ("squat", None),
        "stand": ("stand", None),
    } | {name: (name, 8.0 if name == "sprint" else None) for name in SLOW_TO_MAKE.get(seed, ())}
    return [
        Scenario(name, activity, DURATION_S[activity], speed, heading_deg=float(rng.uniform(-180, 180)))
        for name, (activity, speed) in speeds.items()
    ]


def _examples(seed: int, scenario: Scenario, body: TrueBody, folder: Path) -> Iterator[Example]:
    rate = 200.0 if scenario.activity in GRID else 100.0
    activity, kind = WHAT[scenario.activity]
    ways = {"floor": kind}
    if kind is Kind.OVERGROUND and scenario.activity != "sprint":
        ways["belt"] = Kind.TREADMILL
    paths = {way: folder / f"{seed}-{scenario.name}-{way}.npy" for way in ways}
    if not all(path.exists() for path in paths.values()):
        flat = replace(scenario, heading_deg=0.0) if "belt" in ways else scenario
        trial = simulate_trial(flat, body, np.random.default_rng([seed, len(scenario.name)]))
        np.save(paths["floor"], trial.frames(rate).q)
        if "belt" in ways:
            assert scenario.speed is not None
            carried = on_treadmill(trial, belt_under(trial, scenario.speed))
            np.save(paths["belt"], carried.frames(rate).q)
    model = RigidBodyModel(body.skeleton)
    for way, told in ways.items():
        motion = Motion(body.skeleton.dofs, np.load(paths[way]), rate)
        name = f"person {seed}, {scenario.name}{', belt' if way == 'belt' else ''}"
        yield Example(
            SIMULATED,
            name,
            activity,
            told,
            body.skeleton,
            FEET,
            motion,
            load_BW=load_of(model, motion),
            speed_m_s=scenario.speed,
        )
