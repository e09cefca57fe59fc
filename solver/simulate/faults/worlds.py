"""The people and the laboratories in which effects are hidden, drawn from a seed."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.simulate.demo_subject import MARKERS, STATIC_MARKERS
from solver.simulate.faults.hidden import Recording
from solver.simulate.laboratory import (
    MeasurementSettings,
    Plate,
    measure,
    plates_under,
    recorded_markers,
    standing_plates,
)
from solver.simulate.person import Person, TrueBody, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.simulate.treadmill import belt_under, belts, on_treadmill, read_belts
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

Layout = Literal["treadmill", "overground", "standing"]
ModelKind = Literal["true", "perturbed", "generic"]
PERTURBED_MASS = 0.08  # relative, of each segment of the model handed out
PERTURBED_COM_M = (0.004, 0.010)
GENERIC = "generic body"  # whose mass nobody enters
SMALL = ("talus", "calcn", "toes", "patella")  # segments whose centre of mass cannot be that far off
TWO_TRIALS = 0.12  # share of people of whom two trials are recorded
FASTER = 1.15  # the next trial, than the one before
LARGEST_SOFT_TISSUE_M_PER_RAD = 0.010  # a knee of 1 to 1.7 rad then moves a segment's markers by up to 10 mm


@dataclass(frozen=True)
class WorldPlan:
    """One person doing one thing in one laboratory."""

    seed: int
    activity: Literal["walk", "squat", "stand"]
    layout: Layout
    duration: float  # [s]
    speed: float  # [m/s] of walking
    mass_kg: float
    height_m: float
    sex: Literal["male", "female"]
    mass_scatter: float  # of the true body about the tables
    com_scatter_m: float
    skin: float  # of the simulator's softness of single markers
    soft_tissue_m_per_rad: float  # common to a segment's markers
    right_plate_first: bool
    trials: int = 1  # of the same kind by the same person in the same laboratory, each faster than the last

    def as_json(self) -> dict[str, Any]:
        """For truth.json."""
        return asdict(self)


@dataclass(frozen=True)
class World:
    """The plan come true: a body, its motion in the laboratory's frame, and a static pose.

    `others` are further trials of the same person, each as a world of its own.
    """

    plan: WorldPlan
    person: Person
    body: TrueBody
    trial: SyntheticTrial
    walk_overground: SyntheticTrial  # the same before it was put on a treadmill
    static: SyntheticTrial
    steps_seed: tuple[int, int]
    others: tuple["World", ...] = ()

    def steps(self) -> np.random.Generator:
        """The chance behind the steps or squats of the trial, the same each time it is asked for."""
        return np.random.default_rng(self.steps_seed)


@dataclass(frozen=True)
class Handout:
    """What of a world the laboratory measures and tells, case by case."""

    model: ModelKind
    marker_noise_m: float
    zeroed: bool  # whether the plates read exactly nothing while unloaded
    mass_error: float  # relative, of the mass entered
    seed: int

    def as_json(self) -> dict[str, Any]:
        """For truth.json."""
        return asdict(self)


def plan_world(rng: np.random.Generator, activity: str | None = None, layout: str | None = None) -> WorldPlan:
    """Draw a person and what they do; activity and layout are drawn too where not given."""
    doing = activity or str(rng.choice(["walk", "squat", "stand"], p=[0.8, 0.15, 0.05]))
    place = str(rng.choice(["treadmill", "overground"], p=[0.75, 0.25]))
    if doing != "walk":
        place = "standing"
    sex = str(rng.choice(["male", "female"]))
    height = rng.normal(1.77, 0.07) if sex == "male" else rng.normal(1.65, 0.065)
    height = float(np.clip(height, 1.50, 1.98))
    return WorldPlan(
        seed=int(rng.integers(2**31)),
        activity=doing,  # type: ignore[arg-type]
        layout=layout or place,  # type: ignore[arg-type]
        duration=float(np.round(rng.uniform(3.2, 5.0), 2)),
        speed=float(rng.uniform(0.9, 1.6)),
        mass_kg=float(np.clip(rng.normal(23.5, 3.2), 18, 33) * height**2),
        height_m=height,
        sex=sex,  # type: ignore[arg-type]
        mass_scatter=0.05,
        com_scatter_m=0.005,
        skin=float(rng.uniform(0.3, 1.0)),
        soft_tissue_m_per_rad=float(rng.uniform(0.0, LARGEST_SOFT_TISSUE_M_PER_RAD)),
        right_plate_first=bool(rng.random() < 0.5),
        trials=2 if rng.random() < TWO_TRIALS else 1,
    )


def draw_handout(rng: np.random.Generator, model: ModelKind | None = None) -> Handout:
    """Draw what is measured and told."""
    return Handout(
        model=model or str(rng.choice(["true", "perturbed", "generic"], p=[0.25, 0.4, 0.35])),  # type: ignore[arg-type]
        marker_noise_m=float(rng.uniform(0.0003, 0.001)),
        zeroed=bool(rng.random() < 0.6),
        mass_error=float(np.clip(0.005 * rng.standard_normal(), -0.01, 0.01)),
        seed=int(rng.integers(2**31)),
    )


@lru_cache(maxsize=6)
def world_of(plan: WorldPlan) -> World:
    """Simulate a plan."""
    body_rng, static_rng = np.random.default_rng(plan.seed).spawn(2)
    person = Person(
        mass_kg=plan.mass_kg,
        height_m=plan.height_m,
        sex=plan.sex,
        mass_scatter=plan.mass_scatter,
        com_scatter_m=plan.com_scatter_m,
        bony_softness_m_per_rad=0.005 * plan.skin,
        cluster_softness_m_per_rad=0.014 * plan.skin,
        segment_softness_m_per_rad=plan.soft_tissue_m_per_rad,
    )
    body = body_of(person, body_rng)
    static = simulate_trial(Scenario("static", "stand", duration=0.5), body, static_rng)
    worlds = []
    for k in range(plan.trials):
        own = replace(plan, speed=plan.speed * FASTER**k, trials=1)
        name = plan.activity if k == 0 else f"{plan.activity}_{k + 1}"
        scenario = Scenario(name, plan.activity, duration=plan.duration, speed=own.speed)
        seed = (plan.seed, k)
        over_ground = simulate_trial(scenario, body, np.random.default_rng(seed))
        worlds.append(World(own, person, body, in_laboratory(over_ground, own), over_ground, static, seed))
    return replace(worlds[0], plan=plan, others=tuple(worlds[1:]))


def in_laboratory(over_ground: SyntheticTrial, plan: WorldPlan) -> SyntheticTrial:
    """The walk as the laboratory sees it: on its treadmill, if it is on one."""
    if plan.layout != "treadmill":
        return over_ground
    return on_treadmill(over_ground, belt_under(over_ground, plan.speed))


def record(world: World, trials: Sequence[SyntheticTrial], handout: Handout) -> Recording:
    """Markers, forces and a model, as a laboratory would hand them over.

    Args:
        world: whose.
        trials: what happened, in the order of the world and its others: their own trials, or the same with
            something acting on the person.
        handout: how well it is measured and told.
    """
    marker_rng, force_rng, static_rng, model_rng = np.random.default_rng(handout.seed).spawn(4)
    settings = MeasurementSettings(marker_noise_m=handout.marker_noise_m, zeroed=handout.zeroed)
    captures = []
    for where, trial in zip((world, *world.others), trials, strict=True):
        markers = recorded_markers(trial, MARKERS, settings, marker_rng)
        plates = _forces(where, trial, settings, force_rng)
        captures.append(Capture(trial.scenario.name, markers, plates))
    entered = world.body.skeleton.mass * (1 + handout.mass_error)
    worn = world.body.skeleton
    return Recording(
        trials=tuple(captures),
        mass_kg=float(entered),
        height_m=world.plan.height_m,
        sex=world.plan.sex,
        model=_hand_out(world, handout.model, entered, model_rng),
        static=_static(world, settings, static_rng),
        marker_bodies={m.name: worn.bodies[m.body].name for m in worn.markers if m.name in MARKERS},
    )


def plates_of(world: World) -> tuple[Plate, ...]:
    """The plates in the floor; on a treadmill the right foot's first."""
    contacts = world.trial.contacts
    if world.plan.layout == "treadmill":
        return belts()
    if world.plan.layout == "standing":
        return standing_plates(contacts)
    return plates_under(contacts, (0.0, world.plan.duration))


def _forces(
    world: World, trial: SyntheticTrial, settings: MeasurementSettings, rng: np.random.Generator
) -> tuple[ForcePlate, ...]:
    floor = plates_of(world)
    if world.plan.layout == "overground":
        return measure(trial, floor, ("C7",), settings, rng).plates
    read = read_belts(trial, (floor[0], floor[1]), settings, rng)
    ordered = read if world.plan.right_plate_first else read[::-1]
    return tuple(replace(p, name=f"ground_force_{k + 1}") for k, p in enumerate(ordered))


def _static(world: World, settings: MeasurementSettings, rng: np.random.Generator) -> Markers:
    return recorded_markers(world.static, STATIC_MARKERS, replace(settings, gaps_per_marker_minute=0.0), rng)


def _hand_out(world: World, kind: ModelKind, entered_kg: float, rng: np.random.Generator) -> Skeleton:
    """The model beside the recording; the generic one is nobody's."""
    if kind == "generic":
        return replace(default_skeleton(), name=GENERIC)
    model = replace(world.body.skeleton, name="scaled body")
    if kind == "perturbed":
        model = perturb(model, rng)
    return with_mass(model, entered_kg)


def perturb(model: Skeleton, rng: np.random.Generator) -> Skeleton:
    """Segment masses off by up to 8 %, centres of mass by 4 to 10 mm; the total stays."""
    bodies = []
    for body in model.bodies:
        factor = 1 + PERTURBED_MASS * rng.uniform(-1, 1)
        direction = rng.standard_normal(3)
        far = rng.uniform(*PERTURBED_COM_M) * (0.2 if body.name.startswith(SMALL) else 1.0)
        shift = far * direction / np.linalg.norm(direction)
        bodies.append(
            replace(
                body,
                mass=body.mass * factor,
                inertia_body=body.inertia_body * factor,
                com_body=body.com_body + shift,
            )
        )
    return with_mass(replace(model, bodies=tuple(bodies)), model.mass)
