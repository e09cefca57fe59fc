import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solver.simulate.ground_demand import GroundDemand
from solver.simulate.loads import BodyPoint
from solver.simulate.other_masses import WobblingMass, with_carried_mass, with_segment_masses
from solver.skeleton.pinocchio_model import RigidBodyModel

TIMES = np.arange(0.3, 2.0, 0.01)
GRAVITY = np.array([0.0, -9.80665, 0.0])


def demand(skeleton, motion):
    return GroundDemand(RigidBodyModel(skeleton)).wrench(*motion.state(TIMES))


def test_a_carried_mass_asks_for_its_own_weight_and_acceleration(walk):
    skeleton, at = walk.body.skeleton, np.array([-0.15, 0.3, 0.02])
    more = demand(with_carried_mass(skeleton, "torso", 6.0, at), walk.motion) - demand(skeleton, walk.motion)
    point = BodyPoint(skeleton, "torso", at)
    force = 6.0 * (point.acceleration(walk.motion, TIMES) - GRAVITY)
    differences = 1e-5 * np.abs(force).max()  # the spline's fifth derivative has steps
    np.testing.assert_allclose(more[:, :3], force, atol=differences)
    moment = np.cross(point.position(walk.motion, TIMES), force)
    np.testing.assert_allclose(more[:, 3:], moment, atol=2 * differences)


def test_a_heavier_segment_asks_for_more_at_its_centre_of_mass(walk):
    skeleton = walk.body.skeleton
    more = demand(with_segment_masses(skeleton, {"tibia_r": 1.2}), walk.motion) - demand(
        skeleton, walk.motion
    )
    tibia = skeleton.bodies[skeleton.body_index("tibia_r")]
    point = BodyPoint(skeleton, "tibia_r", tibia.com_body)
    force = 0.2 * tibia.mass * (point.acceleration(walk.motion, TIMES) - GRAVITY)
    np.testing.assert_allclose(more[:, :3], force, atol=1e-5 * np.abs(force).max())


def test_masses_are_linear_in_the_demand(walk):
    skeleton = walk.body.skeleton
    base = demand(skeleton, walk.motion)
    some, twice = (
        demand(with_segment_masses(skeleton, {"femur_r": f, "femur_l": f}), walk.motion) - base
        for f in (1.15, 1.30)
    )
    np.testing.assert_allclose(twice, 2 * some, atol=1e-8)


@pytest.fixture(scope="module")
def belly(walk):
    skeleton = walk.body.skeleton
    return WobblingMass(BodyPoint(skeleton, "torso", np.array([0.0, 0.2, 0.0])), 4.0, 5.0, 0.2)


def test_a_wobbling_mass_obeys_its_equation(walk, belly):
    times = np.arange(0.0, 1.5, 0.002)
    r, _ = belly.displacement(walk.motion, times)
    omega = 2 * np.pi * belly.frequency_Hz
    begin = times[0] - 0.25
    fine = np.arange(begin, 1.5, 0.0005)
    push = -belly.point.acceleration(walk.motion, fine)

    def rate(t, y):
        u = np.array([np.interp(t, fine, push[:, i]) for i in range(3)])
        return np.concatenate([y[3:], u - 2 * 0.2 * omega * y[3:] - omega**2 * y[:3]])

    truth = solve_ivp(
        rate, (begin, times[-1]), np.zeros(6), t_eval=times, rtol=1e-8, atol=1e-10, max_step=0.002
    )
    np.testing.assert_allclose(r, truth.y[:3].T, atol=1e-6)
    assert np.abs(r).max() > 1e-3


def test_what_it_does_is_its_swing_times_its_mass(walk, belly):
    times = np.arange(0.0, 1.5, 0.001)
    r, _ = belly.displacement(walk.motion, times)
    wrench = belly(walk.motion, times)
    swing = (r[2:] - 2 * r[1:-1] + r[:-2]) / 0.001**2
    np.testing.assert_allclose(wrench[1:-1, :3], -4.0 * swing, atol=0.05)


def test_a_stiff_mount_makes_it_part_of_the_segment(walk, belly):
    stiff = WobblingMass(belly.point, 4.0, 200.0, 1.0)
    assert np.abs(stiff(walk.motion, TIMES)[:, :3]).max() < 2.0
    assert np.abs(belly(walk.motion, TIMES)[:, :3]).max() > 10.0
