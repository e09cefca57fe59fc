"""Scaling against OpenSim's own, and what must hold without it."""

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.skeleton.forward import body_poses, marker_positions
from solver.skeleton.osim import load_skeleton
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.scaling import scaled, scaled_inertia, with_mass, with_offsets
from tests.solver.skeleton.test_pinocchio_model import mass_matrix


@pytest.fixture
def scalable(referee, without_muscles, model_files):
    """One model of each family, newly opened: OpenSim scales in place."""
    wanted = ("Rajagopal2016.osim", "gait2354_osim23_format.osim", "LaiUhlrich2022.osim", "hand_scaled.osim")
    files = [path for path in model_files if path.name in wanted]
    assert files
    return [(path, referee(without_muscles(path), load_skeleton(path))) for path in files]


@pytest.mark.opensim
@pytest.mark.real
@pytest.mark.parametrize("uniform", [False, True])
def test_scaled_models_equal_opensims(scalable, random_q, subtests, uniform):
    for path, theirs in scalable:
        rng = np.random.default_rng(8)
        generic = theirs.skeleton
        factors = rng.uniform(0.8, 1.2, (len(generic.bodies), 1 if uniform else 3)) * np.ones(3)
        ours = scaled(generic, factors, mass_kg=66.6)
        theirs.scale(factors, mass_kg=66.6)
        with subtests.test(path.name):
            _assert_same_bodies(ours, theirs)
            _assert_same_pose(ours, theirs, random_q(ours, rng))


def _assert_same_bodies(ours, theirs):
    for body in ours.bodies:
        reference = theirs.model.getBodySet().get(body.name)
        inertia = reference.getInertia()
        np.testing.assert_allclose(body.mass, reference.getMass(), rtol=1e-9)
        np.testing.assert_allclose(body.com_body, reference.getMassCenter().to_numpy(), atol=1e-12)
        np.testing.assert_allclose(
            np.diag(body.inertia_body), inertia.getMoments().to_numpy(), rtol=1e-9, atol=1e-12
        )
        np.testing.assert_allclose(
            body.inertia_body[np.triu_indices(3, 1)], inertia.getProducts().to_numpy(), rtol=1e-9, atol=1e-12
        )


def _assert_same_pose(ours, theirs, q):
    theirs.pose(q)
    if ours.markers:
        np.testing.assert_allclose(marker_positions(ours, q[None])[0], theirs.markers(), rtol=0, atol=1e-9)
    _, origins = body_poses(ours, q[None])
    for name, origin in zip(ours.body_names, origins[0], strict=True):
        np.testing.assert_allclose(origin, theirs.body(name)[1], rtol=0, atol=1e-9)
    ours_M, theirs_M = mass_matrix(RigidBodyModel(ours), q[None])[0], theirs.mass_matrix(q)
    np.testing.assert_allclose(ours_M, theirs_M, rtol=0, atol=1e-6 * np.abs(theirs_M).max())


def test_scaling_returns_a_new_skeleton_and_accumulates(crane):
    factors = np.full((len(crane.bodies), 3), 1.1)
    once = scaled(crane, factors)
    twice = scaled(once, factors)
    assert all((body.scale == 1.0).all() for body in crane.bodies)
    np.testing.assert_allclose([b.scale for b in twice.bodies], 1.21)
    assert once.mass == pytest.approx(crane.mass)


def test_a_uniformly_scaled_body_keeps_its_shape(crane, crane_q):
    """Twice as large: all distances from the root double; its translations are coordinates and stay."""
    double = scaled(crane, np.full((len(crane.bodies), 3), 2.0))
    small, large = marker_positions(crane, crane_q), marker_positions(double, crane_q)
    _, small_root = body_poses(crane, crane_q)
    _, large_root = body_poses(double, crane_q)
    np.testing.assert_allclose(large - large_root[:, :1], 2 * (small - small_root[:, :1]), atol=1e-12)


def test_masses_keep_their_shares(crane):
    heavy = with_mass(crane, 3 * crane.mass)
    for before, after in zip(crane.bodies, heavy.bodies, strict=True):
        assert after.mass == pytest.approx(3 * before.mass)
        np.testing.assert_allclose(after.inertia_body, 3 * before.inertia_body)


def test_a_stretched_cylinder_is_a_cylinder():
    mass, radius, length = 4.0, 0.06, 0.4

    def cylinder(r2, h):
        across = mass * (h**2 / 12 + r2 / 4)
        return np.diag([across, mass * r2 / 2, across])

    stretched = scaled_inertia(cylinder(radius**2, length), mass, np.array([1.1, 1.3, 0.9]))
    np.testing.assert_allclose(stretched, cylinder(radius**2 * 1.1 * 0.9, 1.3 * length), rtol=1e-12)


def test_offsets_move_markers_in_their_bodies(crane):
    offsets = np.arange(3.0 * len(crane.markers)).reshape(-1, 3)
    moved = with_offsets(crane, offsets)
    for before, after, offset in zip(crane.markers, moved.markers, offsets, strict=True):
        np.testing.assert_allclose(after.position_body - before.position_body, offset)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_impossible_factors_and_masses_are_refused(crane, bad):
    with pytest.raises(ModelError, match="scale factors must be positive"):
        scaled(crane, np.full((len(crane.bodies), 3), bad))
    with pytest.raises(ModelError, match="body mass of"):
        with_mass(crane, bad)
