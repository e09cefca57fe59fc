"""The point that two bodies turn about, against the point that they were turned about."""

import numpy as np
import pytest

from benchmarks.functional_centres import LARGEST_ERROR_M, raw_columns, turning_point
from benchmarks.marker_knockout import agreement, markers_alone
from benchmarks.rigid_clusters import cluster_poses
from solver.capture.subject import open_subject
from solver.pipeline import solve
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
    told, axes = np.linalg.eigh(found.information)
    assert told[0] < 1e-9
    np.testing.assert_allclose(np.abs(axes[:, 0]), [0, 0, 1], atol=1e-6)


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
    across = np.linalg.eigh(turning_point(parent, child, np.zeros(3)).information)[1][:, 1:]
    places = [in_parent(parent, cluster[0], f.in_parent)[0] for cluster, f in zip(seen, found, strict=True)]
    off = np.linalg.norm((np.array(places) - CENTRE_IN_PARENT) @ across, axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.004


def test_a_joint_that_hardly_turns_is_not_told():
    parent, child = swing(degrees=2.0, wobble=0.0)
    found = turning_point(*clusters(parent, child, noise_m=0.002), np.zeros(3))
    assert found.error_m(FRAMES / 6) > LARGEST_ERROR_M


@pytest.mark.real
def test_the_model_of_a_recording_made_with_it_is_right(real_data):
    """Also at the knee, which glides; no marker is on the feet."""
    found = agreement(open_subject(real_data / "synthetic_arnold2013_subject01"), "trial").off_turning_point_m
    for joint in ("hip", "knee"):
        alone, with_model = found[joint]
        assert with_model < 0.001 < alone
    assert found["ankle"] is None


@pytest.mark.real
def test_computed_joint_centres_are_no_raw_markers(real_data):
    subject = open_subject(real_data / "opencap_subject4")
    fit = solve(subject, markers_alone(), trials=["walking1"])
    names = fit.trials[0].capture.markers.names
    on_thigh = {names[c] for c in raw_columns(fit, "femur_r")}
    assert {"r_knee", "r_thigh1"} <= on_thigh
    assert "R_HJC" in names
    assert "R_HJC" not in on_thigh
