"""One short walk and one squat, in which everything is hidden: 1.5 s each, 150 frames."""

from dataclasses import replace

import numpy as np
import pytest

from solver.simulate.faults.worlds import Handout, draw_handout, plan_world, record, world_of

DURATION = 1.49  # [s] so that 150 frames are recorded


def short_plan(activity="walk", layout="treadmill", seed=5):
    plan = plan_world(np.random.default_rng(seed), activity, layout)
    return replace(plan, duration=DURATION, speed=1.25, trials=1)


@pytest.fixture(scope="session")
def walk_plan():
    return short_plan()


@pytest.fixture(scope="session")
def walk_world(walk_plan):
    return world_of(walk_plan)


@pytest.fixture(scope="session")
def handout() -> Handout:
    return replace(draw_handout(np.random.default_rng(1), "true"), zeroed=True, marker_noise_m=0.0005)


@pytest.fixture(scope="session")
def recording(walk_world, handout):
    """A clean walk as the laboratory hands it over."""
    return record(walk_world, [walk_world.trial], handout)


@pytest.fixture(scope="session")
def noisy_recording(walk_world, handout):
    """The same from plates whose software writes no zeros."""
    return record(walk_world, [walk_world.trial], replace(handout, zeroed=False))
