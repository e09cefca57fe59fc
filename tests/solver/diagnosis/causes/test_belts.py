"""A belt that speeds up and slows down, or slopes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.capture.capture import Capture
from solver.diagnosis.causes.belts import (
    KNOTS_S,
    MOST_KNOTS,
    MOST_VALUES,
    OF_ALL,
    OF_FORCES,
    BeltAcceleration,
    BeltSlope,
    progression,
)
from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.time_history import DEGREE
from solver.simulate.contacts import about_vertical
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, recorded_markers
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.spline_motion import MovingSupport
from solver.simulate.treadmill import belt_under, belts, on_treadmill, read_belts

WAVES = ((0.35, 0.9, 0.2), (0.25, 1.8, 1.0))


@pytest.fixture(scope="module")
def belt(scene, walk):
    forward = about_vertical(np.radians(walk.scenario.heading_deg)) @ np.array([1.0, 0, 0])
    support = MovingSupport(scene.skeleton, forward, WAVES)
    return support.acceleration(scene.times), support(walk.motion, scene.times)


def test_time_history_is_recovered(scene, fitted, belt):
    acceleration, missing = belt
    (candidate,) = BeltAcceleration.candidates([scene])
    x, covariance = fitted(candidate, scene, missing, (0.0,))
    left = missing - candidate.signature(scene, (0.0,)).columns @ x
    assert np.sqrt((left[:, :3] ** 2).sum() / (missing[:, :3] ** 2).sum()) < 0.06
    found = candidate.estimates([scene], Fitted((0.0,), (0.0,), x, covariance))
    rms = np.sqrt((acceleration**2).sum(axis=1).mean())
    assert found["rms_m_per_s2"].value == pytest.approx(rms, rel=0.05)
    assert candidate.is_notable(found)


def test_has_no_moment_about_the_centre_of_mass(scene):
    (candidate,) = BeltAcceleration.candidates([scene])
    columns = candidate.signature(scene, (0.4,)).columns
    force, moment = columns[:, :3].transpose(0, 2, 1), columns[:, 3:].transpose(0, 2, 1)
    about_com = moment - np.cross(scene.com_ground[:, None], force)
    assert np.abs(about_com).max() < 1e-9


def test_direction_is_the_walk_s(scene, walk):
    assert progression(scene) == pytest.approx(np.radians(walk.scenario.heading_deg), abs=0.05)


def test_direction_on_a_treadmill_is_against_the_belt(straight_walk, treadmill_scene):
    assert np.abs(np.ptp(treadmill_scene.com_ground[:, 0])) < 0.3
    assert progression(treadmill_scene) == pytest.approx(0.0, abs=0.05)


@pytest.fixture(scope="module")
def straight_walk():
    body_rng, motion_rng = np.random.default_rng(7).spawn(2)
    body = body_of(Person(68.0, 1.72), body_rng)
    return simulate_trial(Scenario("belt", "walk", duration=1.6, speed=1.2), body, motion_rng)


@pytest.fixture(scope="module")
def treadmill_scene(straight_walk, seen_of):
    on_belt = on_treadmill(straight_walk, belt_under(straight_walk, 1.2))
    settings = MeasurementSettings()
    markers = recorded_markers(on_belt, MARKERS, settings, np.random.default_rng(1))
    plates = read_belts(on_belt, belts(), settings, np.random.default_rng(2))
    return seen_of(on_belt, Capture("belt", markers, plates))


def test_each_trial_has_its_own_time_history(scene):
    other = replace(scene, name="other")
    candidate, *_ = BeltAcceleration.candidates([scene, other])
    first, second = (candidate.signature(s, (0.0,)).columns for s in (scene, other))
    assert first.shape == second.shape
    assert not (first.any(axis=(0, 1)) & second.any(axis=(0, 1))).any()
    splines_and_constant = candidate.time_histories[0].hump_count(KNOTS_S) + 1
    assert first.any(axis=(0, 1)).sum() == splines_and_constant


def test_a_belt_may_be_uneven_in_one_trial_alone(scene):
    other = replace(scene, name="other")
    both, *alone = BeltAcceleration.candidates([scene, other])
    assert {c.trial for c in both.time_histories} == {scene.name, "other"}
    assert [[c.trial for c in one.time_histories] for one in alone] == [[scene.name], ["other"]]
    last = alone[1]
    assert last.signature(scene, (0.0,)) is None
    x = np.ones(last.signature(other, (0.0,)).columns.shape[2])
    assert [(r.trial, r.start, r.end) for r in last.frames([scene, other], (0.0,), x)] == [
        ("other", 0, scene.frames)
    ]


def test_a_belt_does_not_go_on_speeding_up(scene):
    """Every time history but the constant one has no mean: over the trial the belt gains no speed by it."""
    (candidate,) = BeltAcceleration.candidates([scene])
    force = candidate.signature(scene, (0.0,)).columns[:, :3]
    gained = np.linalg.norm(force.mean(axis=0), axis=0) / np.linalg.norm(force, axis=1).max(axis=0)
    assert gained[:-1].max() < 1e-12
    assert gained[-1] > 0.9
    assert not candidate.admissible((np.pi / 2,))


def test_its_size_is_that_of_the_force_over_the_mass(scene):
    (candidate,) = BeltAcceleration.candidates([scene])
    columns = candidate.signature(scene, (0.0,)).columns
    x = np.random.default_rng(5).normal(size=columns.shape[2])
    force = columns[:, :3] @ x
    rms = np.sqrt((force**2).sum(axis=1).mean()) / scene.skeleton.mass
    found = candidate.estimates([scene], Fitted((0.0,), (0.0,), x, np.zeros((len(x), len(x)))))
    assert found["rms_m_per_s2"].value == pytest.approx(rms, rel=1e-9)


def test_over_minutes_time_histories_are_longer_and_come_some_at_a_time(scene):
    trial = walked_again(scene)
    (candidate,) = BeltAcceleration.candidates([trial])
    pieces = list(candidate.pieces(trial, (0.0,)))
    assert len(pieces) > 1
    assert sum(len(p.prior_std) for p in pieces) == MOST_KNOTS + DEGREE + 1
    assert max(p.columns.size for p in pieces) <= MOST_VALUES


def walked_again(scene, times=40):
    """The walk again and again: only what a belt looks at."""
    return replace(
        scene,
        motion=replace(scene.motion, q=np.tile(scene.motion.q, (times, 1))),
        com_ground=np.tile(scene.com_ground, (times, 1)),
    )


def heading(scene):
    """Where the walk goes."""
    way = (scene.com_ground[-1] - scene.com_ground[0]) * [1.0, 0.0, 1.0]
    return way / np.linalg.norm(way)


def in_axes_of_the_belt(slope_deg, capture, ahead):
    """Wrenches and pressures of a walk, read by plates that lie on the slope."""
    turn = Rotation.from_rotvec(-np.radians(slope_deg) * np.cross(ahead, [0.0, 1.0, 0.0]))
    return replace(
        capture,
        plates=tuple(
            replace(
                plate,
                force_ground=turn.apply(plate.force_ground),
                moment_ground=turn.apply(plate.moment_ground),
                cop_ground=turn.apply(plate.cop_ground),
                point_ground=None,
                corners_ground=turn.apply(plate.corners_ground),
            )
            for plate in capture.plates
        ),
    )


@pytest.mark.parametrize("slope_deg", [-12.0, 6.0, 15.0])
def test_the_true_wrench_comes_back_from_forces_of_the_belt(crisp, seen, slope_deg):
    true = seen(crisp)
    scene = seen(in_axes_of_the_belt(slope_deg, crisp, heading(true)))
    signature = BeltSlope(OF_FORCES).signature(scene, (np.radians(slope_deg),))
    missing = true.measured_ground - scene.measured_ground
    left = missing - signature.fixed
    columns = signature.columns.reshape(-1, 2)
    x = np.linalg.lstsq(columns, left.reshape(-1), rcond=None)[0]
    rest = left.reshape(-1) - columns @ x
    assert np.sqrt((rest**2).mean()) < 0.02 * np.sqrt((missing**2).mean())


@pytest.mark.parametrize("slope_deg", [-8.0, 14.0])
def test_gravity_leans_where_all_is_in_axes_of_the_belt(crisp, seen, slope_deg):
    """Body by body: what the same motion demands more in a field that leans."""
    scene, lean = seen(crisp), np.radians(slope_deg)
    upwards = np.sin(lean) * heading(scene) + np.array([0.0, np.cos(lean) - 1.0, 0.0])
    more = np.zeros((scene.frames, 6))
    for b, body in enumerate(scene.skeleton.bodies):
        centre = scene.p_ground_body[:, b] + scene.R_ground_body[:, b] @ body.com_body
        force = np.broadcast_to(9.80665 * body.mass * upwards, centre.shape)
        more += np.concatenate([force, np.cross(centre, force)], axis=1)
    fixed = BeltSlope(OF_ALL).signature(scene, (lean,)).fixed
    np.testing.assert_allclose(-fixed, more, atol=0.02 * np.abs(more).max())


def test_bounds_and_the_practical_minimum(crisp, seen):
    one = BeltSlope(OF_ALL)
    assert one.admissible((np.radians(8.0),))
    assert not one.admissible((np.radians(2.0),))  # a vertical out of level
    assert not one.admissible((np.radians(40.0),))
    assert all(one.admissible(eta) for eta in one.starts([seen(crisp)]))
    found = one.estimates([], Fitted((np.radians(-7.0),), (np.radians(0.2),), np.zeros(0), np.zeros((0, 0))))
    assert found["slope_deg"].value == pytest.approx(-7.0)
    assert one.is_notable(found)


def test_no_candidate_where_nothing_is_loaded(crisp, seen):
    scene = seen(crisp)
    assert {c.target for c in BeltSlope.candidates([scene])} == {OF_ALL, OF_FORCES}
    assert BeltSlope.candidates([replace(scene, plates=())]) == []
