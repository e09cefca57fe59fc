"""Rotation matrices."""

import numpy as np
import pytest

from solver.skeleton.rotations import body_fixed_angles, body_fixed_xyz, nearest_rotation, rotation_about


def test_a_rotation_keeps_its_axis_and_turns_by_its_angle():
    axis = np.array([1.0, 2.0, -2.0]) / 3
    R = rotation_about(axis, np.array([0.7]))[0]
    np.testing.assert_allclose(R @ axis, axis, atol=1e-15)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)
    assert np.trace(R) == pytest.approx(1 + 2 * np.cos(0.7))


@pytest.mark.parametrize("y", [0.3, -1.2, np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9])
def test_orientation_angles_reproduce_the_rotation_even_in_gimbal_lock(y):
    R = body_fixed_xyz(np.array([0.4, y, -2.1]))
    np.testing.assert_allclose(body_fixed_xyz(body_fixed_angles(R)), R, atol=1e-14)


def test_the_nearest_rotation_to_a_noisy_one_is_a_rotation_near_it():
    rng = np.random.default_rng(11)
    R = body_fixed_xyz(np.array([0.4, -0.2, 1.1]))
    near = nearest_rotation(R + 1e-3 * rng.normal(size=(5, 3, 3)))
    np.testing.assert_allclose(np.linalg.det(near), 1.0)
    np.testing.assert_allclose(near, np.broadcast_to(R, near.shape), atol=5e-3)
