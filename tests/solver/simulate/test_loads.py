import numpy as np
import pytest

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
from solver.skeleton.forward import ForwardKinematics, point_jacobian

TIMES = np.arange(0.2, 2.0, 0.01)
HAND = np.array([0.01, -0.08, 0.02])


@pytest.fixture(scope="module")
def hand(walk):
    return BodyPoint(walk.body.skeleton, "hand_r", HAND)


def jacobian_velocity(walk, times):
    skeleton = walk.body.skeleton
    kinematics = ForwardKinematics(skeleton)
    q, v, _ = walk.motion.state(times)
    poses = kinematics.poses(q)
    body = skeleton.body_index("hand_r")
    point = poses.p_ground_body[:, body] + poses.R_ground_body[:, body] @ HAND
    return np.einsum("tid,td->ti", point_jacobian(kinematics, poses, body, point), v)


def test_a_point_moves_as_its_jacobian_says(walk, hand):
    np.testing.assert_allclose(hand.velocity(walk.motion, TIMES), jacobian_velocity(walk, TIMES), atol=1e-7)


def test_its_acceleration_is_the_slope_of_the_jacobians_velocity(walk, hand):
    h = 1e-5
    slope = (jacobian_velocity(walk, TIMES + h) - jacobian_velocity(walk, TIMES - h)) / (2 * h)
    np.testing.assert_allclose(hand.acceleration(walk.motion, TIMES), slope, atol=2e-4)


def test_the_moment_is_that_of_the_force_at_the_point(walk, hand):
    wrench = PointForce(hand, constant(np.array([3.0, -4.0, 5.0])))(walk.motion, TIMES)
    np.testing.assert_allclose(wrench[:, :3], np.tile([3.0, -4.0, 5.0], (len(TIMES), 1)))
    np.testing.assert_allclose(wrench[:, 3:], np.cross(hand.position(walk.motion, TIMES), [3.0, -4.0, 5.0]))


def test_a_push_is_eased_in_and_out_and_is_nothing_outside():
    law = ease(np.array([10.0, 0, 0]), 0.5, 1.5, 0.2)
    times = np.array([0.4, 0.5, 0.6, 1.0, 1.4, 1.5, 1.6])
    force = law(times, np.zeros((7, 3)), np.zeros((7, 3)))[:, 0]
    np.testing.assert_allclose(force, [0, 0, 5, 10, 5, 0, 0], atol=1e-12)


def test_a_band_pulls_down_the_slope_of_its_energy():
    anchor, stiffness, rest = np.array([1.0, 0.9, -0.2]), 120.0, 0.6

    def energy(point):
        return 0.5 * stiffness * max(np.linalg.norm(anchor - point) - rest, 0.0) ** 2

    points = np.array([[0.0, 0.1, 0.2], [0.9, 0.9, -0.2], [-0.5, 1.2, 0.3]])
    force = spring(anchor, stiffness, rest)(np.zeros(3), points, np.zeros((3, 3)))
    for point, f in zip(points, force, strict=True):
        slope = [(energy(point + d) - energy(point - d)) / 2e-6 for d in 1e-6 * np.eye(3)]
        np.testing.assert_allclose(f, -np.array(slope), atol=1e-5)
    assert (force[1] == 0).all()  # slack


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_drag_takes_power_that_grows_with_its_exponent(exponent):
    velocity = np.random.default_rng(0).standard_normal((20, 3))
    force = drag(7.0, exponent)(np.zeros(20), velocity, velocity)
    speed = np.linalg.norm(velocity, axis=1)
    np.testing.assert_allclose(np.sum(force * velocity, axis=1), -7.0 * speed ** (exponent + 1))


def test_a_torque_may_turn_with_the_segment(walk):
    skeleton = walk.body.skeleton
    time_history = lambda times: np.tile([0.0, 2.0, 1.0], (len(times), 1))  # noqa: E731
    fixed = BodyTorque(skeleton, "torso", time_history, turns_with_body=False)(walk.motion, TIMES)
    turning = BodyTorque(skeleton, "torso", time_history, turns_with_body=True)(walk.motion, TIMES)
    assert not fixed[:, :3].any()
    assert not turning[:, :3].any()
    np.testing.assert_allclose(fixed[:, 3:], time_history(TIMES))
    R = body_rotation(skeleton, "torso", walk.motion, TIMES)
    np.testing.assert_allclose(np.einsum("tji,tj->ti", R, turning[:, 3:]), time_history(TIMES), atol=1e-12)
