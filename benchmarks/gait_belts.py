"""Simulated people on belts: how wrong strides and speeds are, since the same walk over a floor is known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.activities.examples import Example
from benchmarks.activities.simulated import JUDGED, TAUGHT, simulated
from benchmarks.varied import Answer, Variation
from solver.contact.sole import soles
from solver.gait.activity import Kind
from solver.gait.body_motion import BodyMotion, body_motion
from solver.gait.cycles import cycles_of
from solver.gait.foot_motion import FootMotion, foot_motion
from solver.gait.settings import GAIT, GaitSettings
from solver.gait.speed import treadmill_speed
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

ON_BELT = ", belt"
SAME_SHARE = 0.001  # by which a figure may change and be the same


@dataclass(frozen=True, eq=False)
class Belted:
    """One walk or run on a belt, and where its heels would be over a floor."""

    person: str
    speed_m_s: float
    body: BodyMotion
    feet: FootMotion
    heels: tuple[Float[np.ndarray, "frames 3"], ...]
    heels_floor: tuple[Float[np.ndarray, "frames 3"], ...]

    def errors(self, settings: GaitSettings) -> list[float]:
        """Of each stride's length, and of the average speed: shares of what is true."""
        times = self.body.times
        speed = treadmill_speed(self.body.ankles, self.body.stands, self.body.rate, settings)
        found = [1.0 if speed is None else speed / self.speed_m_s - 1]
        for cycle in cycles_of(self.body.stances, self.feet, self.heels, times, settings):
            heel = self.heels_floor[cycle.foot][:, [0, 2]]
            begin, end = (
                [np.interp(t, times, along) for along in heel.T] for t in (cycle.start_s, cycle.end_s)
            )
            found.append(cycle.stride_length_m / float(np.hypot(*np.subtract(end, begin))) - 1)
        return found


def belted(folder: Path) -> Iterator[Belted]:
    """All of the activities' benchmark.

    Args:
        folder: in which motions are kept.
    """
    examples = {example.trial: example for example in simulated((*TAUGHT, *JUDGED), folder)}
    for trial, example in examples.items():
        if example.kind is Kind.TREADMILL:
            yield _belted(example, examples[trial.removesuffix(ON_BELT)])


def belt_answer(walks: Sequence[Belted], usual: GaitSettings, variation: Variation) -> Answer:
    """One value's: how large errors are, and how many figures are others than usual.

    Args:
        walks: on belts.
        usual: with which figures are compared.
        variation: name, factor and settings, which find the same strides.
    """
    name, factor, settings = variation
    sizes: dict[str, list[float]] = {}
    changed = []
    for walk in walks:
        errors = np.array(walk.errors(settings))
        sizes.setdefault(walk.person, []).append(float(np.abs(errors).mean()))
        changed += list(np.abs(errors - walk.errors(usual)) > SAME_SHARE)
    wrong = {person: float(np.mean(each)) / len(sizes) for person, each in sizes.items()}
    return Answer(name, factor, sum(wrong.values()), float(np.mean(changed)), len(changed), wrong)


def _belted(example: Example, over_floor: Example) -> Belted:
    assert example.speed_m_s is not None
    feet, heels = feet_of(example)
    return Belted(
        example.person,
        example.speed_m_s,
        body_motion(example.skeleton, example.feet, example.motion, GAIT),
        feet,
        heels,
        _heels(over_floor, body_poses(over_floor.skeleton, over_floor.motion.q)[1]),
    )


def feet_of(example: Example) -> tuple[FootMotion, tuple[Float[np.ndarray, "frames 3"], ...]]:
    """How the soles move, and where the heels are [m]."""
    corners, p = corners_of(example.skeleton, example.feet, example.motion.q)
    return foot_motion(corners, p[:, 0], example.motion.times, GAIT), _heels(example, p)


def corners_of(
    skeleton: Skeleton, feet: Sequence[str], q: Float[np.ndarray, "frames dofs"]
) -> tuple[list[Float[np.ndarray, "frames corners 3"]], Float[np.ndarray, "frames bodies 3"]]:
    """Corners of the soles of some feet, and origins of all bodies [m]."""
    R, p = body_poses(skeleton, q)
    return [sole.corners_ground(R, p) for sole in soles(skeleton, feet)], p


def _heels(
    example: Example, p: Float[np.ndarray, "frames bodies 3"]
) -> tuple[Float[np.ndarray, "frames 3"], ...]:
    return tuple(p[:, example.skeleton.body_index(foot)] for foot in example.feet)
