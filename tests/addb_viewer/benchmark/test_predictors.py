"""Predictors: the analytical baseline, and our own from angles and from markers."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.evaluating import FolderLog, TimeHistory, evaluate
from addb_viewer.benchmark.from_angles import CUTOFFS_HZ, REACHES, FromAngles
from addb_viewer.benchmark.predictors import Analytical, FromMarkers, feet_on_ground, filtered
from addb_viewer.benchmark.release_trials import open_for_benchmark
from addb_viewer.benchmark.scoring import centre_of_pressure, completed, frame_errors
from addb_viewer.benchmark.task import BenchmarkError, SeenMarkers, central_differences
from solver.contact.sole import soles
from solver.dynamics.force_prediction.divided_wrench import feet_moving_with_ground
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.skeleton.forward import body_poses, marker_positions
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, NAMES, RATE, example


@pytest.fixture(scope="module")
def walk():
    return example()


def test_differences_of_a_parabola_are_exact():
    t = np.arange(20)[:, None] / 50.0
    velocity, acceleration = central_differences(3 * t**2 - 2 * t + 1, 50.0)
    np.testing.assert_allclose(acceleration, 6.0, rtol=1e-9)
    np.testing.assert_allclose(velocity[1:-1], (6 * t - 2)[1:-1], rtol=1e-9)


def test_what_is_left_on_noiseless_motion_is_truncation_and_split(walk):
    predicted = Analytical().predict(walk.seen)
    errors = frame_errors(walk.measured, completed(walk.seen, predicted), walk.seen.skeleton)
    q, dt = walk.seen.q, 1 / walk.seen.rate
    inner = slice(1, -1)
    velocity = (q[2:] - q[:-2]) / (2 * dt)
    acceleration = (q[2:] - 2 * q[1:-1] + q[:-2]) / dt**2

    def com(s):  # along the parabola that the differences stand for
        return centre_of_mass_of(walk.seen.skeleton, q[inner] + s * velocity + s**2 / 2 * acceleration)

    def second(h):
        return (com(h) - 2 * com(0.0) + com(-h)) / h**2

    by_parabola = (4 * second(1e-4) - second(2e-4)) / 3
    truncation = by_parabola - walk.measured.com_acceleration[inner]
    np.testing.assert_allclose(errors["com_acc"][inner], np.linalg.norm(truncation, axis=1), atol=1e-6)
    total = predicted.force.sum(axis=1)[inner] / walk.seen.mass_kg
    some = total.any(axis=1)
    np.testing.assert_allclose(total[some], (by_parabola - GRAVITY)[some], atol=1e-6)
    assert some.mean() > 0.9


def test_the_split_is_even_and_a_foot_in_the_air_has_none(walk):
    force = Analytical().predict(walk.seen).force
    on_ground = feet_on_ground(walk.seen, "height")
    both = on_ground.all(axis=1)
    assert both.any()
    np.testing.assert_array_equal(force[both, 0], force[both, 1])
    assert not force[~on_ground].any()


@pytest.mark.parametrize(("rule", "right"), [("height", 0.5), ("soles", 0.9)])
def test_contact_by_motion(walk, rule, right):
    loaded = walk.measured.force[..., 1] > 20
    assert (feet_on_ground(walk.seen, rule) == loaded).mean() > right


def test_names_say_filter_and_rule():
    assert filtered(6.0).name == "analytical-6Hz"
    assert filtered(contact="soles").name == "analytical-30Hz-soles"


@pytest.fixture(scope="module", params=["walk", "run"])
def answered(request):
    one = example(request.param)
    return one, FromAngles().predict(one.seen)


def test_the_total_is_near_the_truth_and_only_pushes(answered):
    one, predicted = answered
    total = predicted.force.sum(axis=1)
    inner = slice(20, -20)  # the smoothing's own ends
    off = np.linalg.norm(total - one.measured.force.sum(axis=1), axis=1)[inner] / one.seen.mass_kg
    assert off.mean() < {"walk": 0.8, "run": 3.0}[one.measured.activity[0]]  # [N/kg] of 9.8 and up to 25
    assert (total[:, 1] >= 0).all()


def test_nothing_acts_in_flight():
    one = example("run")
    total = np.linalg.norm(FromAngles().predict(one.seen).force.sum(axis=1), axis=1)
    inner = slice(20, -20)
    flies = one.measured.phase[inner] == 0
    assert flies.any()
    assert np.median(total[inner][flies]) == 0.0


def test_pressure_lies_under_the_soles(answered):
    one, predicted = answered
    R, p = body_poses(one.seen.skeleton, predicted.q)
    shown = body_poses(one.seen.skeleton, one.seen.q)[1][:, list(one.seen.feet)]
    for k, sole in enumerate(soles(one.seen.skeleton, one.seen.foot_bodies)):
        corners = sole.corners_ground(R, p)
        height = np.repeat(corners[..., 1].min(axis=1)[:, None], 2, axis=1)
        at, free = centre_of_pressure(predicted.force, predicted.moment, shown, height)
        loaded = np.isfinite(at[:, k, 0])
        low, high = corners[..., [0, 2]].min(axis=1), corners[..., [0, 2]].max(axis=1)
        inside = (at[:, k][:, [0, 2]] > low - 0.001) & (at[:, k][:, [0, 2]] < high + 0.001)
        assert inside[loaded].all()
        assert np.abs(free[loaded, k]).max() < 1e-6


def test_a_swinging_foot_takes_no_part(answered):
    one, _ = answered
    force, moment, feet = one.measured.force, one.measured.moment, one.measured.foot_ground
    total = np.concatenate([force, moment + np.cross(feet, force)], axis=2).sum(axis=1)
    asked = (one.seen.skeleton, NAMES, one.seen.q, total)
    carry = feet_moving_with_ground(*asked, rate=RATE, speed_m_s=0.8)
    loaded = force[..., 1] > 50
    assert carry[loaded].mean() > 0.9  # all but a frame at either end of a contact of twenty
    swings = ~loaded & loaded.any(axis=1)[:, None]
    assert swings.sum() > 20
    assert carry[swings].mean() < 0.25  # about the beginning and the end of a swing
    slower = feet_moving_with_ground(*asked, rate=RATE, speed_m_s=0.1)
    assert (slower <= carry).all()
    np.testing.assert_array_equal(slower.sum(axis=1) >= 1, True)


def test_the_cutoff_and_the_soles_reach_are_chosen_by_others(release, tmp_path):
    source = open_for_benchmark(release)
    train, dev = source.trials(frozenset({"lab/p1"})), source.trials(frozenset({"lab/p0"}))
    chosen = FromAngles()
    chosen.fit(train, dev, FolderLog(tmp_path))
    by_person = {}
    for cutoff in CUTOFFS_HZ:
        means = []
        for persons in (train, dev):
            trials = []
            for one in persons:
                told = FromAngles(cutoff_Hz=cutoff).predict(one.seen).force.sum(axis=1)
                off = np.linalg.norm(told - one.measured.force.sum(axis=1), axis=1)[45:]
                trials.append(off.mean() / one.measured.mass_kg)
            means.append(np.mean(trials))
        by_person[cutoff] = np.mean(means)
    assert chosen.cutoff_Hz == min(by_person, key=by_person.get)
    by_reach = {}
    for reach in REACHES:
        trials = []
        for one in (*train, *dev):
            told = FromAngles(cutoff_Hz=chosen.cutoff_Hz, reach=reach).predict(one.seen).force
            off = np.linalg.norm(told - one.measured.force, axis=2)[45:]
            trials.append((one.person_id, off.mean() / one.measured.mass_kg))
        persons = {person for person, _ in trials}
        by_reach[reach] = np.mean([np.mean([e for p, e in trials if p == person]) for person in persons])
    assert chosen.reach == min(by_reach, key=by_reach.get)


def test_it_is_ahead_of_the_baseline_on_noisy_motion(release, tmp_path):
    source = open_for_benchmark(release)
    ours = evaluate(source, FromAngles, TimeHistory(), tmp_path)
    for cutoff in (6.0, 30.0):
        for rule in ("height", "soles"):
            other = evaluate(source, partial(filtered, cutoff, rule), TimeHistory(), tmp_path)
            for metric in ("grf", "grm", "torque"):
                assert average(ours.scores, metric).mean < average(other.scores, metric).mean


@pytest.fixture(scope="module")
def shown():
    """A walk with exact markers, in another order, and angles that have slow errors."""
    one = example("walk")
    where = marker_positions(one.seen.skeleton, one.seen.q)
    rng = np.random.default_rng(2)
    drift = np.cumsum(rng.standard_normal(one.seen.q.shape), axis=0) * 2e-3
    names = tuple(reversed(one.seen.skeleton.marker_names))
    markers = SeenMarkers((*names, "unknown"), np.concatenate([where[:, ::-1], where[:, :1]], axis=1))
    return one, replace(one.seen, q=one.seen.q + drift, markers=markers)


def test_markers_corrected_by_the_motion(shown):
    one, seen = shown
    with_markers, with_angles = FromMarkers().predict(seen), FromAngles().predict(seen)

    def missed(predicted):
        return np.linalg.norm(predicted.force - one.measured.force, axis=2)[20:-20].mean()

    assert missed(with_markers) < 0.8 * missed(with_angles)


def test_short_stretches_are_told_from_angles(shown):
    _, seen = shown
    few = replace(
        seen, q=seen.q[:4], markers=SeenMarkers(seen.markers.names, seen.markers.position_ground[:4])
    )
    np.testing.assert_array_equal(FromMarkers().predict(few).force, FromAngles().predict(few).force)


def test_without_markers_it_says_so(shown):
    _, seen = shown
    with pytest.raises(BenchmarkError, match="needs markers"):
        FromMarkers().predict(replace(seen, markers=None))
