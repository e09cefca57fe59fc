from dataclasses import replace

import numpy as np
import pytest

from solver.simulate.laboratory import MeasurementSettings
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.treadmill import Belt, belt_under, belts, on_treadmill, read_belts
from solver.skeleton.pinocchio_model import RigidBodyModel

SPEED = 1.3  # [m/s]
PERFECT = MeasurementSettings(force_noise_N=(0, 0, 0), moment_noise_Nm=(0, 0, 0), threshold_N=5.0)


@pytest.fixture(scope="module")
def over_ground(walk):
    scenario = Scenario("w", "walk", duration=2.0, speed=SPEED)
    return simulate_trial(scenario, walk.body, np.random.default_rng(3))


@pytest.fixture(scope="module")
def on_belts(over_ground):
    return on_treadmill(over_ground, belt_under(over_ground, SPEED))


TIMES = np.arange(0.0, 2.0, 0.01)


def test_a_drift_adds_a_line_and_nothing_else(over_ground):
    velocity = np.array([-1.3, 0.2, 0.7])
    moved = Belt(velocity, 0.4).carry(over_ground.motion)
    places = [moved.dofs.index(f"pelvis_t{axis}") for axis in "xyz"]
    q0, v0, a0 = over_ground.motion.state(TIMES)
    q, v, a = moved.state(TIMES)
    np.testing.assert_allclose((q - q0)[:, places], (TIMES[:, None] - 0.4) * velocity, atol=1e-12)
    np.testing.assert_allclose((v - v0)[:, places], np.tile(velocity, (len(TIMES), 1)), atol=1e-10)
    np.testing.assert_allclose(a, a0, atol=1e-8)
    others = np.delete(np.arange(q.shape[1]), places)
    np.testing.assert_array_equal(q[:, others], q0[:, others])


def test_forces_do_not_notice_the_belt(over_ground, on_belts):
    there, here = over_ground.reactions(TIMES), on_belts.reactions(TIMES)
    np.testing.assert_allclose(here.force_ground, there.force_ground, atol=1e-6)
    np.testing.assert_allclose(here.free_moment, there.free_moment, atol=1e-6)
    on = np.isfinite(there.cop_ground)
    moved = there.cop_ground - (TIMES[:, None, None] - 1.0) * np.array([SPEED, 0, 0])
    np.testing.assert_allclose(here.cop_ground[on], moved[on], atol=1e-9)


def test_force_is_mass_times_acceleration_beside_the_belt(on_belts):
    skeleton = on_belts.body.skeleton
    feet = [skeleton.body_index(f"calcn_{side}") for side in "rl"]
    wrenches = on_belts.reactions(TIMES).wrench_ground
    residual = RigidBodyModel(skeleton).inverse_dynamics(*on_belts.motion.state(TIMES), wrenches, feet)[:, :6]
    assert np.abs(residual).max() < 1e-6 * skeleton.mass * 9.8


def test_the_walker_stays_over_the_belts(on_belts):
    right, left = belts()
    cop = on_belts.reactions(TIMES).cop_ground
    loaded = on_belts.reactions(TIMES).force_ground[..., 1] > 50
    x = cop[loaded][:, 0]
    assert np.abs(x).max() < right.half_length
    assert right.centre[1] > 0 > left.centre[1]


def test_each_belt_reads_its_own_foot(on_belts):
    read = read_belts(on_belts, belts(), PERFECT, np.random.default_rng(0))
    reactions = on_belts.reactions(read[0].times)
    for foot, plate in enumerate(read):
        loaded = reactions.force_ground[:, foot, 1] > 5.0
        np.testing.assert_allclose(
            plate.force_ground[loaded], reactions.force_ground[loaded, foot], atol=1e-9
        )
        np.testing.assert_allclose(plate.cop_ground[loaded], reactions.cop_ground[loaded, foot], atol=1e-9)
        assert (plate.force_ground[~loaded] == 0).all()


def test_software_that_writes_no_zeros_leaves_the_noise(on_belts):
    noisy = MeasurementSettings(zeroed=False)
    plate = read_belts(on_belts, belts(), noisy, np.random.default_rng(0))[0]
    unloaded = np.isnan(plate.cop_ground).all(axis=1)
    assert unloaded.sum() > 100
    assert plate.force_ground[unloaded, 0].std() == pytest.approx(noisy.force_noise_N[0], rel=0.15)


def test_other_forces_have_to_be_stated_in_the_frame_they_hold_in(over_ground):
    pulled = replace(over_ground, external=lambda motion, times: np.zeros((len(times), 6)))
    with pytest.raises(ValueError, match="beside the belt"):
        on_treadmill(pulled, belt_under(pulled, SPEED))
