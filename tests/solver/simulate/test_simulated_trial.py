"""Synthetic trials of every kind; a sprint and a landing from a box have impacts, and knots 5 ms apart."""

from dataclasses import dataclass

import numpy as np
import pytest

from solver.simulate.feasible_motion import FootPoints
from solver.simulate.landing import FIRST_LOAD_S, HEEL_DOWN_S
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, SyntheticTrial, simulate_trial
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.segment_tables import RANGES_DEG

LOADED = 30.0  # [N]


@dataclass(frozen=True)
class Within:
    """What an activity stays within; weights are the body's."""

    rate: float = 100.0  # of knots and frames [Hz]
    fine_rate: float = 500.0  # of looks between them
    free_moment_Nm: float = 10.0
    pull: float = 0.005  # weights: the polynomial remainder around flight
    friction: float = 0.5
    pressing: float = 0.0  # weights, from which on friction is looked at
    slip_m: float = 0.003  # of a foot that stands
    sink_m: float = 0.005
    between: float = 0.01  # weights, in flight between frames: a polynomial remainder
    between_rms: float = 0.002


FAST = Within(200.0, 1000.0, 20.0, 0.01, 0.6, 0.25, 0.004, 0.006, 0.10, 0.015)
WITHIN = {"sprint": FAST, "landing": FAST}


@pytest.fixture(scope="module", params=["walk", "run", "squat", "sprint", "landing"])
def case(request) -> tuple[SyntheticTrial, Within]:
    return request.getfixturevalue(request.param), WITHIN.get(request.param, Within())


@pytest.fixture(scope="module", params=["run", "sprint", "landing"])
def flight(request) -> tuple[SyntheticTrial, Within]:
    return request.getfixturevalue(request.param), WITHIN.get(request.param, Within())


def weight(trial):
    return trial.body.skeleton.mass * 9.80665


def times_of(trial, rate=100.0):
    return np.arange(round(trial.scenario.duration * rate) + 1) / rate


def root_residual(trial, times, q, v, a):
    """Generalized forces of the root that the feet's wrenches leave, by recursive Newton-Euler."""
    skeleton = trial.body.skeleton
    feet = [skeleton.body_index(f"calcn_{side}") for side in "rl"]
    wrenches = trial.reactions(times).wrench_ground
    return RigidBodyModel(skeleton).inverse_dynamics(q, v, a, wrenches, feet)[:, :6]


def test_force_is_mass_times_acceleration_at_every_frame(case):
    trial, within = case
    times = times_of(trial, within.rate)
    residual = root_residual(trial, times, *trial.motion.state(times))
    assert np.abs(residual).max() < 1e-6 * weight(trial)


def test_and_from_the_sampled_frames_alone(case):
    """Through the quintic spline that everyone derives accelerations from, away from its free ends."""
    trial, within = case
    motion, ends = trial.frames(within.rate), round(0.1 * within.rate)
    residual = root_residual(trial, motion.times, motion.q, motion.velocity, motion.acceleration)
    assert np.abs(residual[ends:-ends]).max() < 1.0


def test_flight_is_weightless_at_the_frames_and_nearly_between_them(flight):
    trial, within = flight
    frames, fine = times_of(trial, within.rate), times_of(trial, 1000.0)
    flying = trial.contacts.flight(frames)
    assert flying.sum() > 30
    assert np.abs(trial.demand(frames)[flying]).max() < 1e-6 * weight(trial)
    between = trial.demand(fine)[trial.contacts.flight(fine), :3]
    assert np.abs(between).max() < within.between * weight(trial)
    assert np.sqrt(np.mean(between**2)) < within.between_rms * weight(trial)


def test_in_flight_the_centre_of_mass_falls_freely(flight):
    trial, within = flight
    frames = times_of(trial, within.rate)
    rise = RigidBodyModel(trial.body.skeleton).centre_of_mass_acceleration(*trial.motion.state(frames))
    flying = trial.contacts.flight(frames)
    np.testing.assert_allclose(rise[flying] - [0.0, -9.80665, 0.0], 0.0, atol=1e-6)


def test_loaded_feet_are_pressed_within_their_soles(case):
    trial, within = case
    times = times_of(trial, within.fine_rate)
    reactions = trial.reactions(times)
    for stance in trial.contacts.stances:
        on = stance.covers(times) & (reactions.force_ground[:, stance.foot, 1] > LOADED)
        cop_sole = stance.to_sole(reactions.cop_ground[on, stance.foot])
        assert trial.body.sole.contains(cop_sole[:, [0, 2]]).all()
    assert np.abs(reactions.free_moment).max() < within.free_moment_Nm


def test_the_ground_pushes_and_rubs_within_reason(case):
    trial, within = case
    force = trial.reactions(times_of(trial, within.fine_rate)).force_ground
    assert force[..., 1].min() > -within.pull * weight(trial)
    pressing = force[..., 1] > max(LOADED, within.pressing * weight(trial))
    friction = np.hypot(force[..., 0], force[..., 2])[pressing] / force[..., 1][pressing]
    assert friction.max() < within.friction


def test_standing_feet_stay_where_they_are_and_none_sinks_in(case):
    trial, within = case
    times = times_of(trial, 500.0)
    feet = FootPoints(trial.body.skeleton, trial.body.sole)
    points = feet.positions(trial.motion.derivative(times, 0))
    planted = 0
    for stance in trial.contacts.stances:
        for k, body in enumerate(feet.body_names):
            since, until = stance.heel_planted if body == "calcn" else stance.forefoot_planted
            on = (times > since + 0.01) & (times < until - 0.01)
            moved = points[on, stance.foot, k] - stance.to_ground(feet.flat_sole[k])
            planted += int(on.sum())
            assert np.abs(moved).max(initial=0) < within.slip_m
    assert planted > 100
    assert points[..., 1].min() > -within.sink_m


def test_joints_stay_within_human_ranges(case):
    trial, within = case
    q = np.degrees(trial.motion.derivative(times_of(trial, within.rate), 0))
    for d, dof in enumerate(trial.motion.dofs):
        stem = dof[:-2] if dof.endswith(("_r", "_l")) else dof
        if stem in RANGES_DEG:
            low, high = RANGES_DEG[stem]
            assert low <= q[:, d].min(), dof
            assert q[:, d].max() <= high, dof


def test_walking_has_double_support_and_two_humps(walk):
    times = times_of(walk, 500.0)
    vertical = walk.reactions(times).force_ground[..., 1] / weight(walk)
    both = (vertical > 0.05).all(axis=1)
    assert 0.1 < both.mean() < 0.35
    assert not walk.contacts.flight(times).any()
    whole = [s for s in walk.contacts.stances if s.start > 0 and s.end < walk.scenario.duration]
    assert len(whole) >= 2
    for stance in whole:
        share = (times - stance.start) / (stance.end - stance.start)
        time_history = vertical[:, stance.foot]
        first = time_history[(share > 0.1) & (share < 0.4)].max()
        valley = time_history[(share > 0.4) & (share < 0.6)].min()
        second = time_history[(share > 0.6) & (share < 0.95)].max()
        assert 1.0 < first < 1.35
        assert 1.0 < second < 1.35
        assert valley < 0.95


def test_walks_at_its_speed_in_its_direction(walk):
    times = times_of(walk)
    places = [walk.motion.dofs.index(f"pelvis_t{axis}") for axis in "xz"]
    path = walk.motion.derivative(times, 0)[:, places]
    heading = np.radians(25.0)
    travelled = (path[-1] - path[0]) @ np.array([np.cos(heading), -np.sin(heading)])
    assert travelled / 2.4 == pytest.approx(1.3, rel=0.05)
    assert np.abs(path @ np.array([np.sin(heading), np.cos(heading)])).max() < 0.1


def test_running_flies_between_steps_of_two_and_a_half_body_weights(run):
    times = times_of(run, 500.0)
    vertical = run.reactions(times).force_ground[..., 1] / weight(run)
    assert not (vertical > 0.02).all(axis=1).any()
    assert 0.15 < run.contacts.flight(times).mean() < 0.45
    whole = [s for s in run.contacts.stances if s.start > 0 and s.end < run.scenario.duration]
    assert len(whole) >= 2
    for stance in whole:
        assert 2.0 < vertical[stance.covers(times), stance.foot].max() < 3.0


def test_over_whole_strides_the_ground_carries_just_the_weight(walk):
    right = [s.start for s in walk.contacts.stances if s.foot == 0 and 0 < s.start < walk.scenario.duration]
    times = np.arange(right[0], right[-1], 0.001)
    assert walk.demand(times)[:, 1].mean() == pytest.approx(weight(walk), rel=0.01)


def test_squats_deep_and_comes_up_again(squat):
    knee = np.degrees(squat.motion.derivative(times_of(squat), 0)[:, squat.motion.dofs.index("knee_angle_r")])
    assert knee.max() > 70
    assert knee.min() < 15


def test_a_pull_from_elsewhere_leaves_the_ground_with_the_rest():
    def support(motion, times):
        """80 N upwards at the pelvis."""
        places = [motion.dofs.index(f"pelvis_t{axis}") for axis in "xyz"]
        force = np.tile([0.0, 80.0, 0.0], (len(times), 1))
        return np.concatenate([force, np.cross(motion.derivative(times, 0)[:, places], force)], axis=1)

    body = body_of(Person(70.0, 1.75), np.random.default_rng(0))
    trial = simulate_trial(Scenario("s", "squat", duration=2.8), body, np.random.default_rng(1), support)
    times = times_of(trial)
    q, v, a = trial.motion.state(times)
    skeleton = body.skeleton
    wrenches = np.concatenate(
        [trial.reactions(times).wrench_ground, support(trial.motion, times)[:, None]], axis=1
    )
    bodies = [skeleton.body_index(name) for name in ("calcn_r", "calcn_l", "pelvis")]
    residual = RigidBodyModel(skeleton).inverse_dynamics(q, v, a, wrenches, bodies)[:, :6]
    assert np.abs(residual).max() < 1e-6 * weight(trial)
    ground = trial.reactions(times).force_ground[..., 1].sum(axis=1)
    acceleration = RigidBodyModel(skeleton).centre_of_mass_acceleration(q, v, a)[:, 1]
    np.testing.assert_allclose(ground, weight(trial) - 80 + 70 * acceleration, atol=1e-6)
    for stance in trial.contacts.stances:
        cop_sole = stance.to_sole(trial.reactions(times).cop_ground[:, stance.foot])
        assert body.sole.contains(cop_sole[:, [0, 2]]).all()


def test_the_same_generator_gives_the_same_motion():
    body = body_of(Person(), np.random.default_rng(4))
    scenario = Scenario("walk", "walk", duration=0.8)
    one, two, other = (simulate_trial(scenario, body, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.motion.coefficients, two.motion.coefficients)
    assert np.abs(one.motion.coefficients - other.motion.coefficients).max() > 1e-3


def test_a_landing_hits_with_an_impact_of_peoples_size(landing):
    """Both feet: a peak of 3.5 to 5 body weights, 30 to 70 ms after contact; toes first, then heels."""
    times = times_of(landing, 1000.0)
    contact = landing.contacts.stances[0].start
    total = landing.reactions(times).force_ground[..., 1].sum(axis=1) / weight(landing)
    assert np.abs(total[times < contact]).max() == 0.0
    assert 3.5 < total.max() < 5.0
    assert 0.03 < times[np.argmax(total)] - contact < 0.07
    assert total[np.searchsorted(times, contact + FIRST_LOAD_S)] > 1.0
    feet = FootPoints(landing.body.skeleton, landing.body.sole)
    heel = [k for k, body in enumerate(feet.body_names) if body == "calcn"]
    at = feet.positions(landing.motion.derivative(np.array([contact, contact + HEEL_DOWN_S + 0.01]), 0))
    assert at[0, :, heel, 1].min() > 0.03
    assert np.abs(at[1, :, heel, 1]).max() < 0.005
    knee = np.degrees(landing.motion.derivative(times, 0)[:, landing.motion.dofs.index("knee_angle_r")])
    assert knee[times < contact].max() < 35
    assert knee.max() > 55


def test_a_sprinter_flies_most_of_the_time_and_hits_the_ground_hard(sprint):
    times = times_of(sprint, 1000.0)
    vertical = sprint.reactions(times).force_ground[..., 1] / weight(sprint)
    assert not (vertical > 0.02).all(axis=1).any()
    assert 0.45 < sprint.contacts.flight(times).mean() < 0.7
    whole = [s for s in sprint.contacts.stances if s.start > 0 and s.end < sprint.scenario.duration]
    assert len(whole) >= 2
    for stance in whole:
        assert 0.08 < stance.end - stance.start < 0.13
        time_history = vertical[stance.covers(times), stance.foot]
        assert 3.0 < time_history.max() < 4.5
        early = vertical[np.searchsorted(times, stance.start + 0.025), stance.foot]
        assert early > 2.0  # most of the load within 25 ms
    tx = sprint.motion.derivative(times, 0)[:, sprint.motion.dofs.index("pelvis_tx")]
    assert (tx[-1] - tx[0]) / sprint.scenario.duration == pytest.approx(8.5, rel=0.05)
    knee = np.degrees(sprint.motion.derivative(times, 0)[:, sprint.motion.dofs.index("knee_angle_r")])
    assert knee.max() > 100
