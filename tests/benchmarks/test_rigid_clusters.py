"""Poses of rigid groups of markers that are not always seen."""

import numpy as np
import pytest

from benchmarks.rigid_clusters import cluster_poses
from solver.skeleton.rotations import body_fixed_xyz

SHAPE = np.array(
    [[0.0, 0.0, 0.12], [0.0, 0.0, -0.12], [-0.15, 0.01, 0.04], [-0.15, 0.05, -0.04], [0.1, 0.1, 0.0]]
)


@pytest.fixture
def moving():
    t = np.linspace(0, 2, 60)
    R = np.array([body_fixed_xyz([0.3 * u, u, 0.2 * np.sin(u)]) for u in t])
    p = np.stack([t, np.cos(t), 0.3 * t], axis=1)
    return R, p, p[:, None] + np.einsum("tij,mj->tmi", R, SHAPE)


def assert_follows(R, p, found):
    """The cluster's frame keeps its place and direction on the body."""
    turned = np.einsum("tji,tjk->tik", R, found[0])
    placed = np.einsum("tji,tj->ti", R, found[1] - p)
    np.testing.assert_allclose(turned, turned[:1].repeat(len(R), axis=0), atol=1e-9)
    np.testing.assert_allclose(placed, placed[:1].repeat(len(R), axis=0), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(found[0]), 1.0)


def test_poses_follow_the_body(moving):
    R, p, markers = moving
    assert_follows(R, p, cluster_poses(markers))


def test_missing_markers_do_not_move_the_frame(moving):
    R, p, markers = moving
    markers[5:30, 0] = np.nan
    markers[20:50, 3] = np.nan
    assert_follows(R, p, cluster_poses(markers))


def test_two_markers_have_no_pose(moving):
    _, _, markers = moving
    markers[10:12, :3] = np.nan
    R, p = cluster_poses(markers)
    assert np.isnan(R[10:12]).all()
    assert np.isnan(p[10:12]).all()
    assert np.isfinite(p[[9, 12]]).all()


def test_markers_in_a_line_have_no_pose(moving):
    R, p, markers = moving
    in_line = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.002, 0.0]])
    markers[:, :3] = p[:, None] + np.einsum("tij,mj->tmi", R, in_line)
    markers[30:, 3:] = np.nan
    found = cluster_poses(markers)
    assert np.isfinite(found[1][:30]).all()
    assert np.isnan(found[1][30:]).all()


def test_markers_never_seen_have_no_pose():
    R, p = cluster_poses(np.full((5, 4, 3), np.nan))
    assert np.isnan(R).all()
    assert np.isnan(p).all()


def test_the_shape_is_the_mean_of_all_frames(moving):
    """One bent frame has a sixtieth of the say in where the frames lie that lack a marker."""
    _, _, markers = moving
    bent = markers.copy()
    bent[0, 4] += 0.06
    bent[30:, 0] = np.nan
    R, p = cluster_poses(bent)
    in_cluster = np.einsum("tji,tj->ti", R, markers[:, 1] - p)
    assert np.linalg.norm(in_cluster[20] - in_cluster[40]) < 0.002
