"""The point that two bodies turn about, against the point that they were turned about."""

import numpy as np
import pytest

from benchmarks.rigid_clusters import cluster_poses
from benchmarks.turning_point import LARGEST_ERROR_M, Jointed, off_measured, turning_point
from solver.skeleton.rotations import body_fixed_xyz

FRAMES = 200
CENTRE_IN_PARENT = np.array([-0.06, -0.08, 0.08])
PELVIS = np.array([[0.0, 0.0, 0.12], [0.0, 0.0, -0.12], [-0.15, 0.01, 0.04], [-0.15, 0.0, -0.04]])
THIGH = np.array([[0.03, -0.15, 0.06], [0.05, -0.25, 0.05], [-0.02, -0.3, 0.06], [0.0, -0.4, 0.05]])


def swing(degrees=25.0, wobble=0.1, glide_m=0.0):
    """Poses of a parent that moves and turns about a little, and of a child that swings about its z axis.

    Args:
        degrees: of the swing, to each side.
        wobble: about x [rad].
        glide_m: of the child's origin in the parent, to each side.
    """
    t = np.linspace(0, 3, FRAMES)
    R_parent = np.array(
        [body_fixed_xyz([0.1 * np.sin(3 * u), 0.4 + 0.1 * u, 0.08 * np.cos(4 * u)]) for u in t]
    )
    p_parent = np.stack([1.2 * t, 1 + 0.03 * np.sin(6 * t), 0.02 * np.cos(6 * t)], axis=1)
    turned = np.radians(degrees) * np.sin(6 * t)
    own = np.array([body_fixed_xyz([wobble * np.sin(5 * u), 0.0, a]) for u, a in zip(t, turned, strict=True)])
    origin = CENTRE_IN_PARENT + glide_m * np.sin(6 * t)[:, None] * np.array([1.0, 0.0, 0.0])
    child = R_parent @ own, p_parent + np.einsum("tij,tj->ti", R_parent, origin)
    return (R_parent, p_parent), child


def clusters(parent, child, noise_m=0.0, seed=0):
    rng = np.random.default_rng(seed)
    seen = [
        p[:, None] + np.einsum("tij,mj->tmi", R, shape)
        for (R, p), shape in ((parent, PELVIS), (child, THIGH))
    ]
    return [cluster_poses(x + noise_m * rng.standard_normal(x.shape)) for x in seen]


def in_parent(parent, cluster, point):
    """A place in the cluster's frame, in the parent's, and its scatter over the frames."""
    ground = cluster[1] + cluster[0] @ point
    local = np.einsum("tji,tj->ti", parent[0], ground - parent[1])
    return local.mean(axis=0), np.ptp(local, axis=0).max()


def test_the_true_centre_is_found():
    parent, child = swing()
    np.testing.assert_allclose(
        turning_point(parent, child, np.zeros(3)).in_parent, CENTRE_IN_PARENT, atol=1e-9
    )
    found = turning_point(*clusters(parent, child), np.zeros(3))
    place, scatter = in_parent(parent, clusters(parent, child)[0], found.in_parent)
    np.testing.assert_allclose(place, CENTRE_IN_PARENT, atol=1e-9)
    assert scatter < 1e-9
    assert found.residual_m < 1e-9


def test_along_the_axis_of_a_hinge_the_place_stays_as_given():
    parent, child = swing(wobble=0.0)
    near = CENTRE_IN_PARENT + np.array([0.02, 0.01, 0.03])
    found = turning_point(parent, child, near)
    np.testing.assert_allclose(found.in_parent - CENTRE_IN_PARENT, [0, 0, 0.03], atol=1e-9)
    np.testing.assert_allclose(found.across[2], 0.0, atol=1e-6)


def test_a_wrong_start_does_not_matter_where_the_joint_wobbles():
    parent, child = swing(degrees=12.0, wobble=0.1)
    found = turning_point(parent, child, CENTRE_IN_PARENT + np.array([0.0, 0.0, 0.05]))
    np.testing.assert_allclose(found.in_parent, CENTRE_IN_PARENT, atol=1e-9)


def test_a_gliding_joint_turns_about_the_same_point_by_bodies_and_by_clusters():
    """Beside its child's origin, which glides: so a fit is judged by what its bodies do."""
    parent, child = swing(glide_m=0.01)
    by_bodies = turning_point(parent, child, CENTRE_IN_PARENT)
    cluster = clusters(parent, child)
    place, _ = in_parent(parent, cluster[0], turning_point(*cluster, np.zeros(3)).in_parent)
    np.testing.assert_allclose(place, by_bodies.in_parent, atol=1e-9)
    assert np.linalg.norm(by_bodies.in_parent - CENTRE_IN_PARENT) > 0.01


@pytest.mark.parametrize(("degrees", "noise_m"), [(25.0, 0.002), (12.0, 0.001), (8.0, 0.0005)])
def test_where_a_point_is_told_noise_moves_it_by_millimetres(degrees, noise_m):
    """In the two directions that count; where the swing is small it is drawn towards the cluster."""
    parent, child = swing(degrees=degrees)
    seen = [clusters(parent, child, noise_m, seed) for seed in range(40)]
    found = [turning_point(*cluster, np.zeros(3)) for cluster in seen]
    assert max(f.error_m(FRAMES / 6) for f in found) < LARGEST_ERROR_M
    across = turning_point(parent, child, np.zeros(3)).across
    places = [in_parent(parent, cluster[0], f.in_parent)[0] for cluster, f in zip(seen, found, strict=True)]
    off = np.linalg.norm((np.array(places) - CENTRE_IN_PARENT) @ across, axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.004


def fit_with(parent, child, beside):
    """Bodies whose joint sits beside the true one [m, in the parent], and turn as the true ones do."""
    centre = parent[1] + parent[0] @ (CENTRE_IN_PARENT + np.asarray(beside))
    return Jointed(parent, (child[0], centre), centre)


def test_a_fit_is_off_by_where_its_joint_sits():
    parent, child = swing()
    fits = [fit_with(parent, child, beside) for beside in ([0, 0, 0], [0.02, 0, 0], [0, 0.03, 0])]
    np.testing.assert_allclose(
        off_measured(clusters(parent, child), fits, 100), [0, 0.02, 0.03], rtol=0.1, atol=1e-9
    )


def test_along_the_axis_of_a_hinge_nothing_is_compared():
    parent, child = swing(wobble=0.0)
    fits = [fit_with(parent, child, [0, 0, 0.04])]
    assert off_measured(clusters(parent, child), fits, 100)[0] < 1e-6


def test_frames_that_show_one_cluster_only_do_not_count():
    parent, child = swing()
    before, (R, p) = clusters(parent, child)
    p[50:] = np.nan
    assert off_measured((before, (R, p)), [fit_with(parent, child, [0, 0, 0])], 100)[0] < 1e-9
    p[15:] = np.nan
    assert off_measured((before, (R, p)), [fit_with(parent, child, [0, 0, 0])], 100) is None


@pytest.mark.parametrize("noise_m", [0.0, 0.002])
def test_a_joint_that_hardly_turns_is_not_told(noise_m):
    parent, child = swing(degrees=2.0, wobble=0.0)
    fits = [fit_with(parent, child, [0, 0, 0])]
    assert off_measured(clusters(parent, child, noise_m), fits, 100) is None


def test_frames_close_together_do_not_count_as_many():
    """At ten times the rate the same frames last a tenth of the time."""
    parent, child = swing(degrees=12.0)
    noisy, fits = clusters(parent, child, noise_m=0.006), [fit_with(parent, child, [0, 0, 0])]
    assert off_measured(noisy, fits, 10) is not None
    assert off_measured(noisy, fits, 1000) is None
