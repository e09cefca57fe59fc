"""Every physical effect obeys F = ma: held to Newton and Euler by recursion, with the effect stated apart."""

import numpy as np
import pytest

from solver.simulate.faults import physical
from solver.simulate.faults.physical import PHYSICAL, UNKNOWN, beside_the_sole, hide_physical
from solver.simulate.faults.worlds import plates_of, world_of
from solver.simulate.other_masses import with_carried_mass, with_segment_masses
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel

TIMES = np.arange(0.05, 1.45, 0.01)


@pytest.fixture(scope="module")
def overground_world():
    from tests.hidden_effects.conftest import short_plan

    return world_of(short_plan(layout="overground"))


@pytest.fixture
def world_for(walk_world, request):
    return lambda id: request.getfixturevalue("overground_world") if id == "drag" else walk_world


def residual(trial, skeleton, others):
    """Root residual [N, N·m] of the ground's wrenches and others, these about the ground origin."""
    feet = [skeleton.body_index(f"calcn_{side}") for side in "rl"]
    wrenches = trial.reactions(TIMES).wrench_ground
    if others is not None:
        wrenches = np.concatenate([wrenches, others[:, None]], axis=1)
        feet = [*feet, skeleton.body_index("pelvis")]
    return RigidBodyModel(skeleton).inverse_dynamics(*trial.motion.state(TIMES), wrenches, feet)[:, :6]


@pytest.mark.slow
@pytest.mark.parametrize("id", [*PHYSICAL, *UNKNOWN])
@pytest.mark.parametrize("size", [1.0, 2.5])
def test_force_is_mass_times_acceleration(world_for, id, size):
    world = world_for(id)
    trial, hidden = hide_physical(world, id, size, np.random.default_rng(8))
    skeleton, p = world.body.skeleton, hidden.parameters
    if id == "carried_mass":
        skeleton = with_carried_mass(
            skeleton, hidden.target, p["mass_kg"], np.array([p[f"offset_{a}_m"] for a in "xyz"])
        )
    if id == "segment_mass":
        skeleton = with_segment_masses(skeleton, dict.fromkeys(hidden.target.split("+"), p["mass_factor"]))
    others = trial.external(trial.motion, TIMES) if trial.external else None
    weight = skeleton.mass * 9.80665
    assert np.abs(residual(trial, skeleton, others)).max() < 1e-6 * weight
    missing = residual(trial, world.body.skeleton, None)
    assert np.abs(missing).max() > 5.0  # and without the effect it does not hold
    assert beside_the_sole(trial) < 0.05


def point_of(world, body, offset, motion, times):
    R, p = body_poses(world.body.skeleton, motion.derivative(times, 0))
    b = world.body.skeleton.body_index(body)
    return p[:, b] + R[:, b] @ offset


def test_a_contact_has_the_stated_mean_and_point(walk_world):
    trial, hidden = hide_physical(walk_world, "external_contact", 1.5, np.random.default_rng(1))
    ((first, last),) = hidden.frames
    frames = np.arange(150) / 100
    wrench = trial.external(trial.motion, frames)
    p = hidden.parameters
    stated = [p[f"force_{a}_N"] for a in "xyz"]
    np.testing.assert_allclose(wrench[first:last, :3].mean(axis=0), stated, atol=1e-9)
    assert np.linalg.norm(stated) == pytest.approx(60.0, rel=1e-6)
    outside = np.ones(150, dtype=bool)
    outside[first:last] = False
    assert not wrench[outside].any()
    point = point_of(
        walk_world, hidden.target, np.array([p[f"point_{a}_m"] for a in "xyz"]), trial.motion, frames
    )
    np.testing.assert_allclose(wrench[:, 3:], np.cross(point, wrench[:, :3]), atol=1e-9)


def test_less_comes_about_where_nobody_could_move_so(walk_world, monkeypatch):
    """And the truth says how much."""
    monkeypatch.setattr(physical, "OFF_THE_FEET", -1.0)
    _, hidden = hide_physical(walk_world, "body_weight_support", 1.0, np.random.default_rng(1))
    assert physical.LESS * physical.SMALLEST <= hidden.size < physical.SMALLEST
    assert hidden.parameters == {"force_N": pytest.approx(80.0 * hidden.size)}


def test_a_support_lifts_by_what_it_says(walk_world):
    trial, hidden = hide_physical(walk_world, "body_weight_support", 1.0, np.random.default_rng(1))
    np.testing.assert_allclose(
        trial.external(trial.motion, TIMES)[:, :3], np.tile([0, 80.0, 0], (len(TIMES), 1))
    )
    assert hidden.parameters == {"force_N": 80.0}


def test_a_tether_pulls_towards_its_anchor_as_it_says(walk_world):
    trial, hidden = hide_physical(walk_world, "elastic_tether", 1.0, np.random.default_rng(1))
    p, skeleton = hidden.parameters, walk_world.body.skeleton
    frames = np.arange(150) / 100
    com = skeleton.bodies[skeleton.body_index(hidden.target)].com_body
    away = np.array([p[f"anchor_{a}_m"] for a in "xyz"]) - point_of(
        walk_world, hidden.target, com, trial.motion, frames
    )
    length = np.linalg.norm(away, axis=1)
    pull = p["stiffness_N_per_m"] * np.maximum(length - p["rest_length_m"], 0)
    force = trial.external(trial.motion, frames)[:, :3]
    np.testing.assert_allclose(force, (pull / length)[:, None] * away, atol=1e-9)
    assert np.linalg.norm(force, axis=1).mean() == pytest.approx(p["mean_force_N"])
    assert p["mean_force_N"] == pytest.approx(30.0, rel=0.1)


def test_drag_is_its_coefficient_times_the_speed(overground_world):
    trial, hidden = hide_physical(overground_world, "drag", 1.0, np.random.default_rng(1))
    skeleton = overground_world.body.skeleton
    com = skeleton.bodies[skeleton.body_index(hidden.target)].com_body
    path = [point_of(overground_world, hidden.target, com, trial.motion, TIMES + h) for h in (1e-5, -1e-5)]
    velocity = (path[0] - path[1]) / 2e-5
    force = trial.external(trial.motion, TIMES)[:, :3]
    np.testing.assert_allclose(force, -hidden.parameters["b_Ns_per_m"] * velocity, atol=1e-4)


def test_a_belts_acceleration_has_its_rms_along_the_walk(walk_world):
    trial, hidden = hide_physical(walk_world, "belt_acceleration", 1.0, np.random.default_rng(1))
    frames = np.arange(150) / 100
    a = -trial.external(trial.motion, frames)[:, :3] / walk_world.body.skeleton.mass
    assert np.sqrt(np.mean(a[:, 0] ** 2)) == pytest.approx(hidden.parameters["rms_m_per_s2"])
    assert not a[:, 1:].any()


def test_both_belts_bear_their_own_foot(walk_world):
    right, left = plates_of(walk_world)
    reactions = walk_world.trial.reactions(TIMES)
    for foot, plate in enumerate((right, left)):
        on = reactions.force_ground[:, foot, 1] > 100
        assert plate.holds(reactions.cop_ground[on, foot]).mean() > 0.8
