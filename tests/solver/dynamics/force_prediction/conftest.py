"""A simulated walk whose plates lack a wrench that repeats with the step."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from jaxtyping import Bool, Float

from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.skeleton.skeleton import Skeleton

RATE = 100.0
FEET = ("calcn_r", "calcn_l")
HEADING_DEG = 35.0


@dataclass(frozen=True)
class HiddenWrenchWalk:
    trial: SyntheticTrial
    motion: Motion
    wrench_ground: Float[np.ndarray, "frames 6"]  # that acts
    hidden_ground: Float[np.ndarray, "frames 6"]  # part of it, that no plate tells
    in_contact: Bool[np.ndarray, "frames feet"]

    @property
    def skeleton(self) -> Skeleton:
        return self.trial.body.skeleton

    def data(self, *, noise_m: float = 0.001) -> TrialData:
        rng = np.random.default_rng(4)
        exact = self.trial.body.markers(self.motion.q)
        told = self.wrench_ground - self.hidden_ground
        counts = np.ones(self.motion.frames, dtype=bool)
        return TrialData(exact + rng.normal(0, noise_m, exact.shape), told, counts, self.motion)


@pytest.fixture(scope="session")
def hidden_wrench_walk() -> HiddenWrenchWalk:
    body_rng, motion_rng = np.random.default_rng(21).spawn(2)
    body = body_of(Person(70.0, 1.75), body_rng)
    body = replace(body, softness=np.zeros_like(body.softness))
    scenario = Scenario("walk", "walk", duration=4.0, heading_deg=HEADING_DEG)
    trial = simulate_trial(scenario, body, motion_rng)
    motion = trial.frames(RATE)
    reactions = trial.reactions(motion.times).wrench_ground
    return HiddenWrenchWalk(
        trial,
        motion,
        reactions.sum(axis=1),
        repeating_wrench(trial, motion.times, trial.body.skeleton, motion.q),
        reactions[:, :, 1] > 20.0,
    )


def repeating_wrench(trial, times, skeleton, q):
    """Two waves a step ahead and upwards, one to the side of the leg that has just landed; at the pelvis."""
    stances = sorted(trial.contacts.stances, key=lambda stance: stance.start)
    starts = np.array([stance.start for stance in stances])
    sides = np.array([1.0 if stance.foot == 0 else -1.0 for stance in stances])
    k = (np.searchsorted(starts, times, side="right") - 1).clip(0, len(starts) - 2)
    angle = 2 * np.pi * (times - starts[k]) / (starts[k + 1] - starts[k])
    turn = np.radians(HEADING_DEG)
    ahead = np.array([np.cos(turn), 0.0, -np.sin(turn)])
    right = np.array([np.sin(turn), 0.0, np.cos(turn)])
    force = 25 * np.sin(2 * angle)[:, None] * ahead + 15 * sides[k, None] * np.sin(angle)[:, None] * right
    force[:, 1] += 30 * np.cos(2 * angle)
    names = list(skeleton.dofs)
    pelvis = q[:, [names.index(f"pelvis_t{axis}") for axis in "xyz"]]
    return np.concatenate([force, np.cross(pelvis, force)], axis=1)
