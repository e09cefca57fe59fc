"""Joint centres from two clusters that turn about one point, against that point."""

import numpy as np
import pytest

from benchmarks.functional_centres import cluster_poses, off_centre
from solver.skeleton.rotations import body_fixed_xyz

FRAMES = 200
CENTRE_IN_PARENT = np.array([-0.06, -0.08, 0.08])
AXIS = np.array([0.0, 0.0, 1.0])


def swing(wobble=0.1):
    """A parent that moves and turns about a little, and a child that swings by ±25° about its z axis.

    Beside that the child wobbles about x [rad].
    """
    t = np.linspace(0, 3, FRAMES)
    R_parent = np.array(
        [body_fixed_xyz([0.1 * np.sin(3 * u), 0.4 + 0.1 * u, 0.08 * np.cos(4 * u)]) for u in t]
    )
    p_parent = np.stack([1.2 * t, 1 + 0.03 * np.sin(6 * t), 0.02 * np.cos(6 * t)], axis=1)
    own = np.array([body_fixed_xyz([wobble * np.sin(6 * u), 0.0, np.radians(25) * np.sin(6 * u)]) for u in t])
    R_child = R_parent @ own
    return R_parent, p_parent, R_child, p_parent + R_parent @ CENTRE_IN_PARENT


def clusters(swinging, noise_m=0.0, seed=0):
    R_parent, p_parent, R_child, centre = swinging
    rng = np.random.default_rng(seed)
    pelvis = np.array([[0.0, 0.0, 0.12], [0.0, 0.0, -0.12], [-0.15, 0.01, 0.04], [-0.15, 0.0, -0.04]])
    thigh = np.array([[0.03, -0.15, 0.06], [0.05, -0.25, 0.05], [-0.02, -0.3, 0.06], [0.0, -0.4, 0.05]])
    seen = [
        p_parent[:, None] + np.einsum("tij,mj->tmi", R_parent, pelvis),
        centre[:, None] + np.einsum("tij,mj->tmi", R_child, thigh),
    ]
    return [cluster_poses(x + noise_m * rng.standard_normal(x.shape)) for x in seen]


def test_the_true_centre_is_found():
    R_parent, _, R_child, centre = swinging = swing()
    parent, child = clusters(swinging)
    axis = R_child @ AXIS
    assert off_centre(parent, child, centre, axis) < 1e-9
    beside = centre + R_parent @ np.array([0.02, 0.01, 0.0])
    assert off_centre(parent, child, beside, axis) == pytest.approx(np.hypot(0.02, 0.01), rel=0.02)


def test_along_the_axis_of_a_hinge_nothing_is_judged():
    _, _, R_child, centre = swinging = swing(wobble=0.0)
    parent, child = clusters(swinging)
    axis = R_child @ AXIS
    assert off_centre(parent, child, centre + 0.03 * axis, axis) < 1e-9


def test_with_noise_of_a_millimetre_it_stays_within_one_centimetre():
    _, _, R_child, centre = swinging = swing()
    parent, child = clusters(swinging, noise_m=0.001)
    assert off_centre(parent, child, centre, R_child @ AXIS) < 0.01


def test_poses_of_a_cluster_turn_as_it_does():
    R_parent, *_ = swinging = swing()
    R, _ = clusters(swinging)[0]
    np.testing.assert_allclose(R @ R[0].T, R_parent @ R_parent[0].T, atol=1e-9)
