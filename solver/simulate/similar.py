"""The same movement of a larger or smaller person, without simulating it again: dynamic similarity.

Lengths become s times longer, times √s times, masses m'/m times. Velocities then grow by √s, accelerations
stay as gravity does, forces grow by m'/m and moments by s m'/m: F = ma, standing feet and flight hold as
before (equal Froude numbers: Alexander RM, Jayes AS. J Zool 1983; 201: 135-152). Proportions and joint angles
stay the same.
"""

from dataclasses import fields, replace

import numpy as np
from jaxtyping import Float

from solver.simulate.contacts import ContactPlan, Stance, TimeHistory
from solver.simulate.feasible_motion import PLACE
from solver.simulate.person import TrueBody
from solver.simulate.simulated_sole import Sole
from solver.simulate.simulated_trial import SyntheticTrial
from solver.skeleton.scaling import scaled


def similar_body(body: TrueBody, ratio: float, mass_kg: float) -> TrueBody:
    """A person of the same proportions.

    Args:
        body: of whom a movement is known.
        ratio: of statures.
        mass_kg: of the new person.
    """
    skeleton = scaled(body.skeleton, np.full((len(body.skeleton.bodies), 3), ratio), mass_kg)
    coordinates = tuple(
        replace(c, default=c.default * ratio) if c.name in PLACE else c for c in skeleton.coordinates
    )
    return TrueBody(
        replace(skeleton, coordinates=coordinates), _longer_sole(body.sole, ratio), ratio * body.softness
    )


def similar_trial(trial: SyntheticTrial, body: TrueBody) -> SyntheticTrial:
    """What a person of the same proportions does in the same way.

    Args:
        trial: of the first person, whom nothing but the ground and gravity acts on.
        body: by `similar_body` of the first person's; markers and skin may differ.
    """
    if trial.external is not None:
        raise ValueError("what else acts on the person is not scaled")
    ratio = body.sole.length / trial.body.sole.length
    slower = float(np.sqrt(ratio))
    mass_ratio = body.skeleton.mass / trial.body.skeleton.mass
    coefficients = trial.motion.coefficients.copy()
    coefficients[:, [trial.motion.dofs.index(name) for name in PLACE]] *= ratio
    scenario = replace(
        trial.scenario,
        duration=trial.scenario.duration * slower,
        speed=None if trial.scenario.speed is None else trial.scenario.speed * slower,
        centre=(trial.scenario.centre[0] * ratio, trial.scenario.centre[1] * ratio),
    )
    contacts = ContactPlan(
        tuple(_stance(one, ratio, slower, mass_ratio) for one in trial.contacts.stances),
        body.sole,
        trial.contacts.brace * mass_ratio,
        trial.contacts.belt_velocity * slower,
    )
    motion = replace(
        trial.motion,
        coefficients=coefficients,
        start=trial.motion.start * slower,
        spacing=trial.motion.spacing * slower,
    )
    return SyntheticTrial(scenario, body, motion, contacts)


def _longer_sole(sole: Sole, ratio: float) -> Sole:
    return Sole(**{field.name: getattr(sole, field.name) * ratio for field in fields(sole)})


def _stance(stance: Stance, ratio: float, slower: float, mass_ratio: float) -> Stance:
    def later(span: tuple[float, float]) -> tuple[float, float]:
        return span[0] * slower, span[1] * slower

    return Stance(
        foot=stance.foot,
        start=stance.start * slower,
        end=stance.end * slower,
        origin_ground=stance.origin_ground * ratio,
        yaw=stance.yaw,
        load=_slow_down(stance.load, slower, mass_ratio),
        along=_slow_down(stance.along, slower),
        across=_slow_down(stance.across, slower),
        heel_planted=later(stance.heel_planted),
        forefoot_planted=later(stance.forefoot_planted),
    )


def _slow_down(time_history: TimeHistory, slower: float, factor: float = 1.0) -> TimeHistory:
    def at(times: Float[np.ndarray, " times"]) -> Float[np.ndarray, " times"]:
        return factor * time_history(times / slower)

    return at
