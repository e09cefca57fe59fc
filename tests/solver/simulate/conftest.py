import numpy as np
import pytest

from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial

SCENARIOS = {
    "walk": (Scenario("walk", "walk", duration=2.4, heading_deg=25.0), Person(64.0, 1.68, "female")),
    "run": (Scenario("run", "run", duration=1.4), Person(78.0, 1.80, "male")),
    "squat": (
        Scenario("squat", "squat", duration=3.2, heading_deg=-70.0, centre=(1.0, 2.0)),
        Person(70.0, 1.74),
    ),
    "sprint": (Scenario("sprint", "sprint", duration=0.6), Person(78.0, 1.80, "male")),
    "landing": (Scenario("landing", "landing", duration=0.7), Person(78.0, 1.80, "male")),
}


def simulated(name, seed=11):
    scenario, person = SCENARIOS[name]
    body_rng, motion_rng = np.random.default_rng(seed).spawn(2)
    return simulate_trial(scenario, body_of(person, body_rng), motion_rng)


@pytest.fixture(scope="session")
def walk():
    return simulated("walk")


@pytest.fixture(scope="session")
def run():
    return simulated("run")


@pytest.fixture(scope="session")
def squat():
    return simulated("squat")


@pytest.fixture(scope="session")
def sprint():
    return simulated("sprint", seed=7)


@pytest.fixture(scope="session")
def landing():
    return simulated("landing", seed=7)


@pytest.fixture(scope="session", params=["walk", "run", "squat"])
def trial(request):
    return request.getfixturevalue(request.param)
