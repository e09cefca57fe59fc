"""Suggested activities of people who did not teach the weights, and the rules where nothing was learnt."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver.gait.activity import LEARNT, Activity, Kind
from solver.gait.activity_model import (
    NAMES,
    all_classes,
    features_of,
    learnt_weights,
    shares,
    smooth_probabilities,
    windows_of,
)
from solver.gait.activity_rules import kind_of, unlearnt
from solver.gait.activity_suggestion import LEAST_CONFIDENCE, named_activity, suggest_activities
from solver.gait.body_motion import BodyMotion, body_motion
from solver.gait.gait_events import Source, Stance
from solver.gait.settings import GAIT
from solver.gait.trial_gait import overground_speed, treadmill_speed
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.treadmill import belt_under, on_treadmill
from solver.skeleton.pinocchio_model import RigidBodyModel

FEET = ("calcn_r", "calcn_l")
RATE = 100.0


@pytest.fixture(scope="module")
def stranger():
    return body_of(Person(83.0, 1.86, "male"), np.random.default_rng(77))


@pytest.fixture(scope="module")
def trials(stranger):
    """Motions by name; the belt's is that of the floor."""
    rng = np.random.default_rng(5)
    walk = simulate_trial(Scenario("w", "walk", 2.4, 1.5), stranger, rng)
    squat = simulate_trial(Scenario("s", "squat", 2.4), stranger, rng)
    stand = simulate_trial(Scenario("n", "stand", 2.4), stranger, rng)
    belt = on_treadmill(walk, belt_under(walk, 1.5))
    return {"floor": walk, "belt": belt, "squat": squat, "stand": stand}


@pytest.fixture(scope="module")
def seen(trials, stranger):
    model, found = RigidBodyModel(stranger.skeleton), {}
    for name, trial in trials.items():
        motion = trial.frames(RATE)
        rise = model.centre_of_mass_acceleration(motion.q, motion.velocity, motion.acceleration)[:, 1]
        found[name] = body_motion(stranger.skeleton, FEET, motion, GAIT, 1 + rise / 9.80665)
    return found


@pytest.mark.parametrize(
    ("name", "activity", "kind"),
    [
        ("floor", Activity.WALKING, Kind.OVERGROUND),
        ("belt", Activity.WALKING, Kind.TREADMILL),
        ("squat", Activity.SQUAT, None),
        ("stand", Activity.STANDING, Kind.BOTH_FEET),
    ],
)
def test_a_stranger_is_understood_from_the_motion_alone(seen, name, activity, kind):
    (found,) = suggest_activities(seen[name], "x", learnt_weights())
    assert (found.start, found.end) == (0, 241)
    assert (found.activity, found.kind) == (activity, kind)
    assert found.confidence >= LEAST_CONFIDENCE


def test_a_squat_off_the_plates_may_be_a_chair_and_only_the_name_tells(seen):
    off = replace(seen["squat"], load_BW=None)
    assert suggest_activities(off, "x", learnt_weights()) == ()
    (named,) = suggest_activities(off, "squats1", learnt_weights())
    assert named.activity is Activity.SQUAT
    assert named.confidence < suggest_activities(seen["squat"], "x", learnt_weights())[0].confidence


def test_a_seat_that_bears_the_weight_makes_a_squat_a_sit_to_stand(seen):
    motion = seen["squat"]
    height = motion.pelvis[:, 1]
    low = height < height.min() + 0.15 * motion.leg
    seated = replace(motion, load_BW=np.where(low, 0.4, 1.0))
    (found,) = suggest_activities(seated, "x", learnt_weights())
    assert (found.activity, found.by) == (Activity.SIT_TO_STAND, "rule (unlearnt)")


def test_windows_and_cells_cover_the_trial_without_overlap(seen):
    for motion in seen.values():
        windows = windows_of(motion)
        assert windows.cells[0][0] == 0
        assert windows.cells[-1][1] == motion.frames
        assert all(a[1] == b[0] for a, b in pairwise(windows.cells))
        assert all(0 <= a < b <= motion.frames for a, b in windows.spans)


def test_features_do_not_depend_on_heading_place_and_floor(seen):
    motion = seen["floor"]
    moved = replace(motion, pelvis=motion.pelvis + np.array([5.0, 1.0, -3.0]), soles=motion.soles + 1.0)
    for span in windows_of(motion).spans:
        np.testing.assert_allclose(features_of(moved, span), features_of(motion, span), atol=1e-12)


def test_probabilities_are_those_of_a_multinomial_model():
    weights, x = learnt_weights(), np.random.default_rng(1).random((5, len(NAMES)))
    for row, told in zip(x, shares(weights, x), strict=True):
        odds = [np.exp(w @ row + b) for w, b in zip(weights.weights, weights.bias, strict=True)]
        np.testing.assert_allclose(told, np.array(odds) / sum(odds), rtol=1e-12)


def every_time_history(probabilities, change):
    """The likeliest time history by trying all."""
    evidence = np.log(np.clip(probabilities, 0.02, 1)) / 4
    count, classes = evidence.shape
    best, found = -np.inf, None
    for code in range(classes**count):
        time_history = [code // classes**k % classes for k in range(count)]
        value = sum(evidence[k, c] for k, c in enumerate(time_history))
        value -= change * sum(a != b for a, b in pairwise(time_history))
        if value > best:
            best, found = value, time_history
    return found


@pytest.mark.parametrize("seed", range(4))
def test_smoothing_finds_the_likeliest_of_all_time_histories(seed):
    sharp = np.random.default_rng(seed).dirichlet([0.2, 0.2, 0.2], 8) ** 3
    probabilities = sharp / sharp.sum(axis=1, keepdims=True)
    assert smooth_probabilities(probabilities).tolist() == every_time_history(probabilities, np.log(9))


def test_learnt_classes_come_first():
    assert all_classes()[: len(LEARNT)] == LEARNT
    assert set(all_classes()) == set(Activity)


@pytest.mark.parametrize(
    ("name", "activity"),
    [
        ("walking1", Activity.WALKING),
        ("run0900cms", Activity.RUNNING),
        ("FAILT01_SLDJ06", Activity.JUMP),
        ("STS1", Activity.SIT_TO_STAND),
        ("squats1", Activity.SQUAT),
        ("stairs_up_2", Activity.STAIRS),
        ("static02", Activity.STANDING),
        ("trial", None),
        ("levelground_ccw_fast_01_01", Activity.WALKING),
        ("brunch", None),
    ],
)
def test_what_names_say(name, activity):
    assert named_activity(name) is activity


def climber(riser):
    """Someone who steps up, a foot after the other, every half second."""
    frames = 400
    times = np.arange(frames) / RATE
    stances = tuple(Stance(k % 2, 0.5 * k, 0.5 * k + 0.6, Source.FEET) for k in range(1, 7))
    soles, stands = np.zeros((frames, 2)), np.zeros((frames, 2), dtype=bool)
    for k, stance in enumerate(stances):
        inside = (times >= stance.contact_s) & (times < stance.off_s)
        soles[inside, stance.foot] = riser * k
        stands[inside, stance.foot] = True
    steady = np.full(frames, 0.8)
    still = np.zeros((frames, 3))
    return BodyMotion(
        RATE, times, 0.9, still, still, still, steady, 0 * steady, np.zeros((frames, 2)), 0 * steady,
        np.zeros((frames, 2, 3)), soles, stands, stances,
    )  # fmt: skip


def test_stairs_are_told_by_two_risers_of_one_sign():
    whole = (0, 400)
    for riser, kind in ((0.17, Kind.UP), (-0.17, Kind.DOWN)):
        assert unlearnt(climber(riser), whole)[Activity.STAIRS] > 0.95
        assert kind_of(climber(riser), Activity.STAIRS, whole) is kind
    assert unlearnt(climber(0.01), whole)[Activity.STAIRS] < 0.05


def test_the_speed_over_the_floor_is_within_two_per_cent(trials):
    model = RigidBodyModel(trials["floor"].body.skeleton)
    com = model.centre_of_mass(trials["floor"].frames(RATE).q)
    assert overground_speed(np.gradient(com, 1 / RATE, axis=0)) == pytest.approx(1.5, rel=0.02)


def test_the_speed_of_the_belt_is_within_two_per_cent_by_feet_and_by_forces(trials, seen):
    motion = seen["belt"]
    assert treadmill_speed(motion.ankles[:, :, None], motion.stands, RATE) == pytest.approx(1.5, rel=0.02)
    load = trials["belt"].reactions(motion.times).wrench_ground[:, :, 1]
    assert treadmill_speed(motion.ankles[:, :, None], load > 20.0, RATE) == pytest.approx(1.5, rel=0.02)


def test_a_foot_that_turns_on_the_belt_is_carried_as_fast_as_the_belt():
    """Heel and ball of a foot that rolls on, as people do: one of them is at rest on the belt."""
    frames, belt = 100, 1.3
    on = np.zeros((frames, 1), dtype=bool)
    on[10:80] = True
    times = np.arange(frames) / RATE
    carried = np.stack([-belt * times, 0 * times, 0 * times], axis=1)
    lifted = np.radians(40.0) * np.clip(times - times[30], 0.0, None) / times[30]  # about the ball
    from_ball = np.stack([-0.18 * np.cos(lifted) + 0.08 * np.sin(lifted), 0 * times, 0 * times], axis=1)
    points = np.stack([carried + from_ball, carried], axis=1)[:, None]
    assert treadmill_speed(points, on, RATE) == pytest.approx(belt, rel=1e-6)
    assert treadmill_speed(points[:, :, :1], on, RATE) < 0.97 * belt


def test_no_speed_without_a_whole_stance():
    ankles = np.zeros((50, 2, 1, 3))
    assert treadmill_speed(ankles, np.ones((50, 2), dtype=bool), RATE) is None
    assert overground_speed(np.zeros((0, 3))) is None
