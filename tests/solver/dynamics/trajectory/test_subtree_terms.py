"""Against dense marker Jacobians, on a skeleton in which one dof drives several joints."""

import numpy as np
import pytest

from solver.dynamics.trajectory.terms.markers import SubtreeTerms
from solver.skeleton.forward import ForwardKinematics, marker_jacobian


@pytest.fixture(scope="module")
def moving(crane, crane_q):
    kinematics = ForwardKinematics(crane)
    poses = kinematics.poses(crane_q[:9])
    x = kinematics.markers(poses)
    tree = SubtreeTerms(kinematics)
    return tree, tree.twists(poses), x, marker_jacobian(kinematics, poses, x)


def test_some_dof_has_axes_in_several_joints(moving):
    tree, *_ = moving
    assert tree.axes > tree.dofs


def test_gradient(moving):
    tree, S, x, J = moving
    force = np.random.default_rng(0).normal(size=x.shape)
    expected = np.einsum("tij,ti->tj", J, force.reshape(len(x), -1))
    np.testing.assert_allclose(tree.gradient(S, x, force), expected, atol=1e-12 * np.abs(expected).max())


def test_terms_of_one_frame(moving):
    tree, S, x, J = moving
    weight = np.random.default_rng(1).uniform(0, 2, size=x.shape[:2])
    expected = J.transpose(0, 2, 1) @ (np.repeat(weight, 3, axis=1)[:, :, None] * J)
    np.testing.assert_allclose(tree.same_frame(S, x, weight), expected, atol=1e-12 * np.abs(expected).max())


def test_terms_between_frames(moving):
    tree, S, x, J = moving
    weight = np.random.default_rng(2).uniform(0, 2, size=(len(x) - 1, x.shape[1]))
    expected = J[1:].transpose(0, 2, 1) @ (np.repeat(weight, 3, axis=1)[:, :, None] * J[:-1])
    np.testing.assert_allclose(
        tree.between_frames(S, x, weight), expected, atol=1e-12 * np.abs(expected).max()
    )
