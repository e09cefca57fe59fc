"""What forces on segments and their inertias add to the balance, and which lie between others."""

import numpy as np

from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.observed_trial import force_at
from solver.diagnosis.causes.on_segments import (
    columns_at_point,
    inner_arm_segments,
    inner_segments,
    prior_with_reach,
    required_by_bodies,
    required_by_changes,
    trunk_bodies,
)
from solver.simulate.other_masses import with_segment_masses


def test_shifts_of_the_point_are_first_moments(scene):
    """Exact at any size: a force is linear in its arm."""
    body = scene.skeleton.body_index("femur_l")
    point, shift = np.array([0.02, -0.2, 0.01]), np.array([0.05, 0.03, -0.04])
    time_history = np.random.default_rng(1).standard_normal((scene.frames, 3))
    columns = columns_at_point(scene, body, point, time_history)
    given = columns @ np.array([7.0, *(7.0 * shift)])
    exact = force_at(7.0 * time_history, scene.point_ground(body, point + shift))
    assert np.abs(given - exact).max() < 1e-12 * np.abs(exact).max() + 1e-12


def test_prior_of_shifts_is_the_force_times_the_reach():
    assert prior_with_reach(50.0, 0.1).tolist() == [50.0, 5.0, 5.0, 5.0]


def test_trunk_is_the_root_and_the_heaviest_body_without_a_counterpart(scene):
    assert trunk_bodies(scene.skeleton) == ("pelvis", "torso")


def named(skeleton, bodies):
    return {skeleton.body_names[b] for b in bodies}


def test_arms_and_shanks_lie_between_others(scene):
    arms = {f"{bone}_{side}" for bone in ("humerus", "ulna", "radius") for side in "rl"}
    inner = named(scene.skeleton, inner_segments(scene.skeleton))
    assert arms | {"tibia_r", "tibia_l"} <= inner
    assert not inner & {"pelvis", "torso", "femur_r", "femur_l", "hand_r", "hand_l", "toes_r", "patella_l"}
    assert named(scene.skeleton, inner_arm_segments(scene.skeleton)) == arms


def test_loads_are_rarely_carried_on_the_arm_itself(scene):
    rare = {c.target for c in CarriedMass.candidates([scene]) if c.place_odds}
    usual = {c.target for c in CarriedMass.candidates([scene]) if not c.place_odds}
    assert {"humerus_r", "ulna_l", "radius_r"} <= rare
    assert {"pelvis", "torso", "hand_l", "femur_r", "tibia_r", "calcn_l"} <= usual
    assert not rare & usual


LEG = ("femur_r", "tibia_r")


def test_bodies_demand_what_the_whole_does_beyond_the_rest(scene, demand_of):
    without = with_segment_masses(scene.skeleton, dict.fromkeys(LEG, 1e-9))
    expected = demand_of(scene.skeleton) - demand_of(without)
    given = required_by_bodies(scene, [scene.skeleton.body_index(name) for name in LEG])
    assert np.abs(given - expected).max() < 1e-5 * np.abs(expected).max()


def test_a_point_mass_demands_its_acceleration_against_gravity(scene):
    """Second differences of the point's place."""
    body, r = scene.skeleton.body_index("hand_l"), np.array([0.03, -0.1, 0.02])
    change = np.outer(np.append(r, 1.0), np.append(r, 1.0))[None]
    place = scene.point_ground(body, r)
    force = np.diff(place, 2, axis=0) * scene.rate**2 - scene.skeleton.gravity
    given = required_by_changes(scene, body, change)[1:-1, :, 0]
    assert np.sqrt(((given[:, :3] - force) ** 2).mean()) < 0.02 * np.sqrt((force**2).mean())
    moment = np.cross(place[1:-1], given[:, :3])
    assert np.abs(given[:, 3:] - moment).max() < 1e-9 * np.abs(moment).max() + 1e-9
