"""Physical effects: what acts on the person, or weighs otherwise, while the motion stays one that could be.

The motion of a world is kept and the ground supplies what it demands with the effect, so that F = ma holds
exactly. Only where the centre of pressure would leave the foot is the motion made anew with the effect. Some
are in no catalogue: each acts on the person and obeys F = ma like everything else.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solver.common.gravity import GRAVITY
from solver.simulate.faults.hidden import REFERENCE_SIZE, Hidden
from solver.simulate.faults.measurement_effects import direction, sign
from solver.simulate.faults.worlds import World, in_laboratory
from solver.simulate.loads import (
    BodyPoint,
    BodyTorque,
    PointForce,
    body_rotation,
    constant,
    drag,
    ease,
    spring,
)
from solver.simulate.other_masses import WobblingMass, with_carried_mass, with_segment_masses
from solver.simulate.simulated_trial import External, SyntheticTrial, simulate_trial
from solver.simulate.spline_motion import MovingSupport, SplineMotion
from solver.simulate.treadmill import Belt, belt_under
from solver.skeleton.forward import cross
from solver.skeleton.skeleton import Skeleton

COP_MARGIN_M = 0.01  # that a centre of pressure may lie beside the sole before the motion is made anew
COP_SHARE = 0.03  # of the loaded samples that may do so
OFF_THE_FEET = 0.05  # share beyond which nobody could have moved so: another place is drawn, or less of it
TRIES = 4
LESS, SMALLEST = 0.7, 0.3  # of the size, where no place will do
LOADED_N = 100.0
TORQUE_NM = 15.0  # RMS of torques at size 1
FORCE_N = 45.0  # RMS of forces at size 1
DIFFERENCE = 1e-4  # [s]


@dataclass(frozen=True)
class Physics:
    """Another mass distribution, another external wrench, or both."""

    skeleton: Skeleton | None = None
    external: External | None = None


Drawn = tuple[Physics, Hidden]
Draw = Callable[[World, float, np.random.Generator], Drawn]


def hide_physical(
    world: World, id: str, size: float, rng: np.random.Generator
) -> tuple[SyntheticTrial, Hidden]:
    """The world's trial with one physical effect.

    Args:
        world: whose motion.
        id: of the catalogue, or one of `UNKNOWN`.
        size: in reference sizes, of unknown ones in multiples of 45 N or 15 N·m RMS; less comes about where
            nobody could move so with all of it.
        rng: draws body, point, direction and time.
    """
    while True:
        for _ in range(TRIES if id in PHYSICAL else 1):
            physics, hidden = (PHYSICAL | UNKNOWN)[id](world, size, rng)
            trial = happening(world, physics)
            if beside_the_sole(trial) <= OFF_THE_FEET or size < SMALLEST:
                return trial, _as_it_came(hidden, trial, physics)
        size *= LESS


def happening(world: World, physics: Physics) -> SyntheticTrial:
    """The trial in which the physics holds; the motion stays if the ground can still act under the feet."""
    body = replace(world.body, skeleton=physics.skeleton) if physics.skeleton else world.body
    kept = replace(world.trial, body=body, external=physics.external)
    if physics.external is None or beside_the_sole(kept) <= COP_SHARE:
        return kept
    belt = belt_under(world.trial, world.plan.speed if world.plan.layout == "treadmill" else 0.0)
    scenario = world.walk_overground.scenario
    anew = simulate_trial(scenario, body, world.steps(), _seen_from_belt(physics.external, belt))
    return replace(in_laboratory(replace(anew, external=None), world.plan), external=physics.external)


def beside_the_sole(trial: SyntheticTrial) -> float:
    """Share of loaded samples whose centre of pressure lies off the sole."""
    times = np.arange(round(trial.scenario.duration * 100) + 1) / 100
    reactions = trial.reactions(times)
    standing = reactions.cop_ground - times[:, None, None] * trial.contacts.belt_velocity
    off = total = 0
    for stance in trial.contacts.stances:
        on = stance.covers(times) & (reactions.force_ground[:, stance.foot, 1] > LOADED_N)
        points = stance.to_sole(standing[on, stance.foot])[:, [0, 2]]
        total += len(points)
        off += int((~trial.contacts.sole.contains(points, COP_MARGIN_M)).sum())
    return off / max(total, 1)


def _seen_from_belt(external: External, belt: Belt) -> External:
    """The same wrench for a motion in the frame that moves with the belt."""

    def on_belt(motion: SplineMotion, times: np.ndarray) -> np.ndarray:
        wrench = external(belt.carry(motion), times)
        force = wrench[:, :3]
        return np.concatenate([force, wrench[:, 3:] - cross(belt.displacement(times), force)], axis=1)

    return on_belt


def _as_it_came(hidden: Hidden, trial: SyntheticTrial, physics: Physics) -> Hidden:
    """Parameters that depend on the motion, from the motion that came about."""
    frames = np.arange(round(trial.scenario.duration * 100) + 1) / 100
    external = physics.external
    if not isinstance(external, PointForce):
        return hidden
    force = external.force(trial.motion, frames)
    parameters = dict(hidden.parameters)
    if hidden.id == "external_contact":
        ((first, last),) = hidden.frames
        mean = force[first:last].mean(axis=0)
        parameters |= {f"force_{axis}_N": float(f) for axis, f in zip("xyz", mean, strict=True)}
    elif "mean_force_N" in parameters:
        parameters["mean_force_N"] = float(np.linalg.norm(force, axis=1).mean())
    return replace(hidden, parameters=parameters)


# ---- the catalogue's physical effects -------------------------------------------------------------------


def _contact(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["hand_r", "hand_l", "pelvis", "torso", "femur_r", "femur_l"]))
    point = _point(world, body, rng)
    length = rng.uniform(0.25, 0.6) * world.plan.duration
    since = rng.uniform(0.1, 0.9) * (world.plan.duration - length)
    ramp = min(0.2, length / 3)
    waves = ((rng.uniform(0.05, 0.25), rng.uniform(0.5, 1.5), rng.uniform(0, 2 * np.pi)),)
    along = direction(rng)
    frames = _frames(since, since + length)
    inside = np.arange(*frames) / 100
    unit = ease(along, since, since + length, ramp, waves)(inside, inside, inside)
    height = size * REFERENCE_SIZE["external_contact"] / np.linalg.norm(unit.mean(axis=0))
    force = PointForce(point, ease(height * along, since, since + length, ramp, waves))
    parameters = {f"force_{axis}_N": 0.0 for axis in "xyz"} | _point_parameters(point, "point")
    hidden = Hidden("external_contact", body, parameters, size, world.trial.scenario.name, (frames,))
    return Physics(external=force), hidden


def _support(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["pelvis", "torso"]))
    newtons = size * REFERENCE_SIZE["body_weight_support"]
    force = PointForce(_centre(world, body), constant(np.array([0.0, newtons, 0.0])))
    return Physics(external=force), Hidden("body_weight_support", body, {"force_N": newtons}, size)


def _tether(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["pelvis", "torso"]))
    point = _centre(world, body)
    times = _times(world)
    path = point.position(world.trial.motion, times)
    angle = rng.choice([0.0, np.pi]) + rng.uniform(-0.5, 0.5)
    reach = rng.uniform(0.9, 1.6)
    anchor = path.mean(axis=0) + reach * np.array([np.cos(angle), 0.0, np.sin(angle)])
    anchor[1] += rng.uniform(-0.15, 0.15)
    wanted = size * REFERENCE_SIZE["elastic_tether"]
    stiffness = float(rng.uniform(1.2 * wanted / reach, 6 * wanted / reach))
    lengths = np.linalg.norm(path - anchor, axis=1)
    low, high = 0.0, float(lengths.max())
    for _ in range(60):
        rest = (low + high) / 2
        if stiffness * np.maximum(lengths - rest, 0).mean() > wanted:
            low = rest
        else:
            high = rest
    force = PointForce(point, spring(anchor, stiffness, rest))
    parameters = {"stiffness_N_per_m": stiffness, "mean_force_N": wanted, "rest_length_m": rest}
    parameters |= {f"anchor_{axis}_m": float(a) for axis, a in zip("xyz", anchor, strict=True)}
    return Physics(external=force), Hidden("elastic_tether", body, parameters, size)


def _drag(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["torso", "pelvis"]))
    point = _centre(world, body)
    times = _times(world)
    speed = np.linalg.norm(point.velocity(world.trial.motion, times), axis=1).mean()
    newtons = size * REFERENCE_SIZE["drag"]
    b = float(newtons / speed)
    parameters = {"b_Ns_per_m": b, "mean_force_N": newtons}
    return Physics(external=PointForce(point, drag(b))), Hidden("drag", body, parameters, size)


def _belt(world: World, size: float, rng: np.random.Generator) -> Drawn:
    rms = size * REFERENCE_SIZE["belt_acceleration"]
    waves = tuple(
        (float(rng.uniform(0.4, 1.0)), float(f), float(rng.uniform(0, 2 * np.pi)))
        for f in rng.uniform(0.4, 4.0, 4)
    )
    forward = np.array([1.0, 0.0, 0.0])
    times = _times(world)
    raw = MovingSupport(world.body.skeleton, forward, waves).acceleration(times)[:, 0]
    factor = rms / np.sqrt(np.mean(raw**2))
    scaled = tuple((factor * a, f, p) for a, f, p in waves)
    support = MovingSupport(world.body.skeleton, forward, scaled)
    return Physics(external=support), Hidden("belt_acceleration", "all", {"rms_m_per_s2": rms}, size)


def _slope(world: World, size: float, rng: np.random.Generator) -> Drawn:
    """Who walks up a belt in axes of the belt feels gravity lean backwards."""
    slope = sign(rng) * size * REFERENCE_SIZE["belt_slope"]
    leaning = GRAVITY * np.array([np.sin(np.radians(slope)), np.cos(np.radians(slope)) - 1.0, 0.0])
    support = MovingSupport(world.body.skeleton, leaning, ((1.0, 0.0, np.pi / 2),))
    hidden = Hidden("belt_slope", "markers_and_forces", {"slope_deg": slope}, size)
    return Physics(external=support), hidden


def _carried(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["torso", "pelvis", "hand_r", "hand_l", "tibia_r", "tibia_l"]))
    point = _point(world, body, rng)
    if body == "torso":  # a rucksack
        point = replace(point, point_body=np.array([-0.18, rng.uniform(0.15, 0.4), rng.uniform(-0.03, 0.03)]))
    kilograms = size * REFERENCE_SIZE["carried_mass"]
    heavier = with_carried_mass(world.body.skeleton, body, kilograms, point.point_body)
    frames = ((0, round(world.plan.duration * 100) + 1),)
    parameters = {"mass_kg": kilograms} | _point_parameters(point, "offset")
    return Physics(heavier), Hidden("carried_mass", body, parameters, size, world.trial.scenario.name, frames)


def _segment(world: World, size: float, rng: np.random.Generator) -> Drawn:
    bodies = ("femur_r", "femur_l", "tibia_r", "tibia_l")
    factor = 1 + sign(rng) * size * REFERENCE_SIZE["segment_mass"]
    heavier = with_segment_masses(world.body.skeleton, dict.fromkeys(bodies, factor))
    hidden = Hidden("segment_mass", "+".join(bodies), {"mass_factor": factor}, size)
    return Physics(heavier), hidden


def _wobbling(world: World, size: float, rng: np.random.Generator) -> Drawn:
    kilograms = size * REFERENCE_SIZE["wobbling_mass"]
    frequency, damping = float(rng.uniform(3.0, 7.0)), float(rng.uniform(0.08, 0.3))
    mass = WobblingMass(_centre(world, "torso"), kilograms, frequency, damping)
    parameters = {"mass_kg": kilograms, "frequency_Hz": frequency, "damping_ratio": damping}
    return Physics(external=mass), Hidden("wobbling_mass", "torso", parameters, size)


PHYSICAL: dict[str, Draw] = {
    "external_contact": _contact,
    "body_weight_support": _support,
    "elastic_tether": _tether,
    "drag": _drag,
    "belt_acceleration": _belt,
    "carried_mass": _carried,
    "segment_mass": _segment,
    "wobbling_mass": _wobbling,
    "belt_slope": _slope,
}


def _frames(since: float, until: float, rate: float = 100.0) -> tuple[int, int]:
    return int(np.ceil(since * rate)), int(np.floor(until * rate)) + 1


def _centre(world: World, body: str) -> BodyPoint:
    skeleton = world.body.skeleton
    return BodyPoint(skeleton, body, skeleton.bodies[skeleton.body_index(body)].com_body)


def _point(world: World, body: str, rng: np.random.Generator) -> BodyPoint:
    """A point of a segment within some centimetres of its centre of mass."""
    centre = _centre(world, body)
    spread = 0.02 if body.startswith("hand") else 0.05
    return replace(centre, point_body=centre.point_body + spread * rng.uniform(-1, 1, 3))


def _point_parameters(point: BodyPoint, word: str) -> dict[str, float]:
    return {f"{word}_{axis}_m": float(x) for axis, x in zip("xyz", point.point_body, strict=True)}


@dataclass(frozen=True)
class SpinningWheel:
    """A wheel that spins fast about an axis fixed in a segment: its torque is −dh/dt on the segment."""

    skeleton: Skeleton
    body: str
    momentum_body: np.ndarray  # [kg·m²/s]

    def __call__(self, motion: SplineMotion, times: np.ndarray) -> np.ndarray:
        """Force (none) and moment [N·m]."""
        after, before = (
            body_rotation(self.skeleton, self.body, motion, times + step) @ self.momentum_body
            for step in (DIFFERENCE, -DIFFERENCE)
        )
        torque = -(after - before) / (2 * DIFFERENCE)
        return np.concatenate([np.zeros_like(torque), torque], axis=1)


def _torque(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["torso", "pelvis", "femur_r", "femur_l"]))
    axis = direction(rng)
    rate, phase = rng.uniform(0.3, 1.2), rng.uniform(0, 2 * np.pi)
    amplitude = size * TORQUE_NM * np.sqrt(2)

    def time_history(times: np.ndarray) -> np.ndarray:
        return amplitude * np.sin(2 * np.pi * rate * times + phase)[:, None] * axis

    external = BodyTorque(world.body.skeleton, body, time_history, turns_with_body=True)
    return Physics(external=external), Hidden("unknown_torque", body, {"rms_Nm": size * TORQUE_NM}, size)


def _wheel(world: World, size: float, rng: np.random.Generator) -> Drawn:
    body = str(rng.choice(["femur_r", "femur_l", "tibia_r", "tibia_l"]))
    axis = np.array([sign(rng), 0.2, 0.3])
    wheel = SpinningWheel(world.body.skeleton, body, axis)
    rms = np.sqrt(np.mean(np.sum(wheel(world.trial.motion, _times(world))[:, 3:] ** 2, axis=1)))
    wheel = replace(wheel, momentum_body=axis * size * TORQUE_NM / rms)
    return Physics(external=wheel), Hidden("unknown_wheel", body, {"rms_Nm": size * TORQUE_NM}, size)


def _sideways_on_hand(world: World, size: float, rng: np.random.Generator) -> Drawn:
    side = str(rng.choice(["r", "l"]))
    way = sign(rng)

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return way * np.sum(velocity**2, axis=1)[:, None] * np.array([0.0, 0.0, 1.0])

    return _force(world, f"hand_{side}", np.zeros(3), law, id="unknown_v2_sideways", size=size)


def _on_head(world: World, size: float, rng: np.random.Generator) -> Drawn:
    axis, phase = direction(rng), rng.uniform(0, 2 * np.pi)
    at = np.array([0.05, 0.32 * world.plan.height_m, 0.0])

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * 1.7 * times + phase)[:, None] * axis

    return _force(world, "torso", at, law, id="unknown_periodic_on_head", size=size, absolute=True)


def _shaking(world: World, size: float, rng: np.random.Generator) -> Drawn:
    rate, phase = rng.uniform(3.5, 5.5), rng.uniform(0, 2 * np.pi)

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * rate * times + phase)[:, None] * np.array([0.0, 0.0, 1.0])

    return _force(world, "pelvis", np.array([0.0, 0.0, 0.0]), law, id="unknown_shaking", size=size)


def _crosswise(world: World, size: float, rng: np.random.Generator) -> Drawn:
    """A force at right angles to the velocity, as a magnetic field makes it."""
    body = str(rng.choice(["tibia_r", "tibia_l", "hand_r", "hand_l"]))
    field = direction(rng)

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.cross(velocity, field)

    return _force(world, body, np.zeros(3), law, id="unknown_crosswise", size=size)


UNKNOWN: dict[str, Draw] = {
    "unknown_torque": _torque,
    "unknown_wheel": _wheel,
    "unknown_v2_sideways": _sideways_on_hand,
    "unknown_periodic_on_head": _on_head,
    "unknown_shaking": _shaking,
    "unknown_crosswise": _crosswise,
}
ONE_LIMB = (("hand", "radius", "ulna"), ("tibia", "talus", "calcn", "toes"))


def _force(
    world: World,
    body: str,
    offset: np.ndarray,
    law: Callable,
    *,
    id: str,
    size: float,
    absolute: bool = False,
) -> Drawn:
    """A law at a point, scaled so that its RMS over the trial is what the size says."""
    skeleton = world.body.skeleton
    centre = skeleton.bodies[skeleton.body_index(body)].com_body
    force = PointForce(BodyPoint(skeleton, body, offset if absolute else centre + offset), law)
    rms = np.sqrt(np.mean(np.sum(force.force(world.trial.motion, _times(world)) ** 2, axis=1)))
    factor = size * FORCE_N / rms
    scaled = PointForce(force.point, lambda t, x, v: factor * law(t, x, v))
    hidden = Hidden(id, body, {"rms_N": size * FORCE_N}, size, bodies=_near(body))
    return Physics(external=scaled), hidden


def _near(body: str) -> tuple[str, ...]:
    """The segment and those that move with it so nearly that no wrench on the whole body tells them apart."""
    stem, _, side = body.partition("_")
    for limb in ONE_LIMB:
        if stem in limb:
            return tuple(f"{name}_{side}" for name in limb)
    return (body,)


def _times(world: World) -> np.ndarray:
    return np.arange(round(world.plan.duration * 100) + 1) / 100
