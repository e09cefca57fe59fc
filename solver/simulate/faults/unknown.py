"""Effects that no catalogue lists: each acts on the person and obeys F = ma like everything else."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solver.simulate.faults.hidden import Hidden
from solver.simulate.faults.physical import (
    LESS,
    OFF_THE_FEET,
    SMALLEST,
    Physics,
    beside_the_sole,
    happening,
)
from solver.simulate.faults.worlds import World
from solver.simulate.loads import BodyPoint, BodyTorque, PointForce, body_rotation
from solver.simulate.spline_motion import SplineMotion
from solver.simulate.trial import SyntheticTrial
from solver.skeleton.skeleton import Skeleton

TORQUE_NM = 15.0  # RMS of torques at size 1
FORCE_N = 45.0  # RMS of forces at size 1
DIFFERENCE = 1e-4  # [s]


def hide_unknown(
    world: World, id: str, size: float, rng: np.random.Generator
) -> tuple[SyntheticTrial, Hidden]:
    """The world's trial with something in it that has no name, as strong as a walker can bear.

    Args:
        world: whose motion.
        id: one of `UNKNOWN`.
        size: wanted, in multiples of 45 N or 15 N·m RMS; the truth says what came about.
        rng: draws body, direction and time.
    """
    while True:
        physics, hidden = UNKNOWN[id](world, size, rng)
        trial = happening(world, physics)
        if beside_the_sole(trial) <= OFF_THE_FEET or size < SMALLEST:
            return trial, hidden
        size *= LESS


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


def _torque(world: World, size: float, rng: np.random.Generator) -> tuple[Physics, Hidden]:
    body = str(rng.choice(["torso", "pelvis", "femur_r", "femur_l"]))
    axis = _axis(rng)
    rate, phase = rng.uniform(0.3, 1.2), rng.uniform(0, 2 * np.pi)
    amplitude = size * TORQUE_NM * np.sqrt(2)

    def time_history(times: np.ndarray) -> np.ndarray:
        return amplitude * np.sin(2 * np.pi * rate * times + phase)[:, None] * axis

    external = BodyTorque(world.body.skeleton, body, time_history, turns_with_body=True)
    return Physics(external=external), Hidden("unknown_torque", body, {"rms_Nm": size * TORQUE_NM}, size)


def _wheel(world: World, size: float, rng: np.random.Generator) -> tuple[Physics, Hidden]:
    body = str(rng.choice(["femur_r", "femur_l", "tibia_r", "tibia_l"]))
    axis = np.array([rng.choice([-1.0, 1.0]), 0.2, 0.3])
    wheel = SpinningWheel(world.body.skeleton, body, axis)
    rms = np.sqrt(np.mean(np.sum(wheel(world.trial.motion, _times(world))[:, 3:] ** 2, axis=1)))
    wheel = replace(wheel, momentum_body=axis * size * TORQUE_NM / rms)
    return Physics(external=wheel), Hidden("unknown_wheel", body, {"rms_Nm": size * TORQUE_NM}, size)


def _sideways_on_hand(world: World, size: float, rng: np.random.Generator) -> tuple[Physics, Hidden]:
    side = str(rng.choice(["r", "l"]))
    sign = float(rng.choice([-1.0, 1.0]))

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return sign * np.sum(velocity**2, axis=1)[:, None] * np.array([0.0, 0.0, 1.0])

    return _force(world, f"hand_{side}", np.zeros(3), law, id="unknown_v2_sideways", size=size)


def _on_head(world: World, size: float, rng: np.random.Generator) -> tuple[Physics, Hidden]:
    axis, phase = _axis(rng), rng.uniform(0, 2 * np.pi)
    at = np.array([0.05, 0.32 * world.plan.height_m, 0.0])

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * 1.7 * times + phase)[:, None] * axis

    return _force(world, "torso", at, law, id="unknown_periodic_on_head", size=size, absolute=True)


def _shaking(world: World, size: float, rng: np.random.Generator) -> tuple[Physics, Hidden]:
    rate, phase = rng.uniform(3.5, 5.5), rng.uniform(0, 2 * np.pi)

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * rate * times + phase)[:, None] * np.array([0.0, 0.0, 1.0])

    return _force(world, "pelvis", np.array([0.0, 0.0, 0.0]), law, id="unknown_shaking", size=size)


def _crosswise(world: World, size: float, rng: np.random.Generator) -> tuple[Physics, Hidden]:
    """A force at right angles to the velocity, as a magnetic field makes it."""
    body = str(rng.choice(["tibia_r", "tibia_l", "hand_r", "hand_l"]))
    field = _axis(rng)

    def law(times: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return np.cross(velocity, field)

    return _force(world, body, np.zeros(3), law, id="unknown_crosswise", size=size)


UNKNOWN: dict[str, Callable[[World, float, np.random.Generator], tuple[Physics, Hidden]]] = {
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
) -> tuple[Physics, Hidden]:
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


def _axis(rng: np.random.Generator) -> np.ndarray:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)
