"""Forces that nobody measured, predicted from a motion whose true forces are known."""

import numpy as np
import pytest

from solver.common.filters import low_pass
from solver.dynamics.force_prediction.missing_wrench import predict_ground_forces
from solver.dynamics.root_wrench import centre_of_mass
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.skeleton.forward import ForwardKinematics

RATE, CUTOFF_HZ = 100.0, 5.0
LEVEL_NOISE_N, NOISE_SEED = 400.0, 3


@pytest.fixture(scope="module", params=["walk", "run"])
def truth(request):
    """True wrench of the ground, and the centre of mass, of an activity with and one without flight."""
    body_rng, motion_rng = np.random.default_rng(11).spawn(2)
    body = body_of(Person(70.0, 1.75, "male"), body_rng)
    trial = simulate_trial(Scenario(request.param, request.param, duration=1.6), body, motion_rng)
    times = np.arange(round(1.6 * RATE) + 1) / RATE
    poses = ForwardKinematics(body.skeleton).poses(trial.frames(RATE).q)
    return trial.demand(times), centre_of_mass(body.skeleton, poses), body.skeleton.mass


def force_error(wrench, truth, inner=slice(10, -10)):
    return np.sqrt(((wrench - truth)[inner, :3] ** 2).sum(axis=1).mean())


def noisy(demand):
    """As accelerations of white marker noise are: growing with the square of frequency."""
    rng = np.random.default_rng(NOISE_SEED)
    path = rng.standard_normal((len(demand) + 2, 6))
    return demand + LEVEL_NOISE_N * np.diff(path, n=2, axis=0)


def test_nothing_acts_in_flight_and_elsewhere_the_ground_only_pushes_or_nearly(truth):
    demand, com, mass = truth
    found = predict_ground_forces(noisy(demand), com, RATE, CUTOFF_HZ)
    up = demand[:, 1]
    flies = up < 0.02 * mass * 9.81
    assert np.array_equal(found.wrench_ground[found.flies], np.zeros((found.flies.sum(), 6)))
    assert not found.flies[up > 0.6 * mass * 9.81].any()
    if flies.any():
        assert found.flies[flies].mean() > 0.5
    else:
        assert not found.flies.any()


def test_forces_come_nearer_to_the_truth_than_through_a_filter(truth):
    demand, com, _ = truth
    found = predict_ground_forces(noisy(demand), com, RATE, CUTOFF_HZ)
    plain = low_pass(noisy(demand), RATE, 6.0)
    assert force_error(found.wrench_ground, demand) < 1.1 * force_error(plain, demand)
    if found.flies.any():
        assert force_error(found.wrench_ground, demand) < 0.9 * force_error(plain, demand)


def test_a_steady_weight_is_predicted_to_the_newton():
    demand = np.zeros((200, 6))
    demand[:, 1] = 700.0
    com = np.tile([0.4, 1.0, -0.2], (200, 1))
    demand[:, 3:] = np.cross(com, demand[:, :3])
    found = predict_ground_forces(demand, com, RATE, CUTOFF_HZ)
    np.testing.assert_allclose(found.wrench_ground, demand, atol=1.0)
    assert not found.flies.any()


def test_a_few_frames_have_no_accelerations_and_are_left_as_they_are():
    demand = np.arange(18.0).reshape(3, 6)
    found = predict_ground_forces(demand, np.zeros((3, 3)), RATE, CUTOFF_HZ)
    np.testing.assert_array_equal(found.wrench_ground, demand)
