from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.chain import Fixed, chain_of
from solver.skeleton.functions import Linear
from solver.skeleton.rotations import body_fixed_angles, body_fixed_xyz, nearest_rotation, rotation_about
from solver.skeleton.skeleton import Coordinate


def test_every_moving_axis_has_one_driving_dof_and_locked_axes_none(crane):
    chain = chain_of(crane)
    assert chain.dofs == len(crane.dofs) == 12
    assert chain.positions == 6 + 3 + 2 + 1 + 1 + 1
    assert sum(isinstance(s, Fixed) for s in chain.steps[4]) >= 1


def test_derivatives_of_the_coupling_map_match_finite_differences(crane, crane_q):
    chain = chain_of(crane)
    _, slope, curvature = chain.couple(crane_q)
    step = 1e-5
    ahead, behind = chain.couple(crane_q + step), chain.couple(crane_q - step)
    np.testing.assert_allclose(slope, (ahead[0] - behind[0]) / (2 * step), atol=1e-9)
    np.testing.assert_allclose(curvature, (ahead[1] - behind[1]) / (2 * step), atol=1e-9)


def test_a_coupled_coordinate_follows_its_master(crane, crane_q):
    chain = chain_of(crane)
    p, _, _ = chain.couple(crane_q)
    cap = list(chain.body).index(3)
    knee = crane_q[:, crane.dofs.index("knee_angle")]
    np.testing.assert_allclose(p[:, cap], 0.6 * knee + 0.05 + 0.1)


def test_circular_couplings_are_named(crane):
    circle = tuple(
        replace(c, coupling=Linear(1.0, 0.0), coupled_to="cap_angle") if c.name == "knee_angle" else c
        for c in crane.coordinates
    )
    assert isinstance(circle[0], Coordinate)
    with pytest.raises(ModelError, match="coupled in a circle"):
        chain_of(replace(crane, coordinates=circle))


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
