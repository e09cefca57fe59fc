"""A sprint and a landing from a box: truths with impacts. Frames and knots lie 5 ms apart."""

import numpy as np
import pytest

from solver.simulate.landing import FIRST_LOAD_S, HEEL_DOWN_S
from solver.simulate.person import Person, body_of
from solver.simulate.trajectory_fit import FootPoints
from solver.simulate.trial import Scenario, simulate_trial
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.segment_tables import RANGES_DEG

RATE = 200.0
LOADED = 30.0  # [N]


def simulated(activity, duration):
    body_rng, motion_rng = np.random.default_rng(7).spawn(2)
    body = body_of(Person(78.0, 1.80, "male"), body_rng)
    return simulate_trial(Scenario(activity, activity, duration=duration), body, motion_rng)


@pytest.fixture(scope="module")
def sprint():
    return simulated("sprint", 0.6)


@pytest.fixture(scope="module")
def landing():
    return simulated("landing", 0.7)


@pytest.fixture(scope="module", params=["sprint", "landing"])
def trial(request):
    return request.getfixturevalue(request.param)


def weight(trial):
    return trial.body.skeleton.mass * 9.80665


def times_of(trial, rate=RATE):
    return np.arange(round(trial.scenario.duration * rate) + 1) / rate


def root_residual(trial, times, q, v, a):
    skeleton = trial.body.skeleton
    feet = [skeleton.body_index(f"calcn_{side}") for side in "rl"]
    wrenches = trial.reactions(times).wrench_ground
    return RigidBodyModel(skeleton).inverse_dynamics(q, v, a, wrenches, feet)[:, :6]


@pytest.mark.slow
def test_newton_and_euler_leave_next_to_nothing(trial):
    times = times_of(trial)
    assert np.abs(root_residual(trial, times, *trial.motion.state(times))).max() < 1e-6 * weight(trial)


def test_nor_do_they_from_the_sampled_frames_alone(trial):
    motion = trial.frames(RATE)
    residual = root_residual(trial, motion.times, motion.q, motion.velocity, motion.acceleration)
    assert np.abs(residual[20:-20]).max() < 1.0


def test_flight_is_weightless(trial):
    """At the frames; between two of them the polynomials leave some per cent, most just before contact."""
    frames = times_of(trial)
    flying = trial.contacts.flight(frames)
    assert flying.sum() > 30
    assert np.abs(trial.demand(frames)[flying]).max() < 1e-6 * weight(trial)
    fine = times_of(trial, 1000.0)
    between = trial.demand(fine)[trial.contacts.flight(fine), :3]
    assert np.abs(between).max() < 0.10 * weight(trial)
    assert np.sqrt(np.mean(between**2)) < 0.015 * weight(trial)


def test_in_flight_the_centre_of_mass_falls_freely(trial):
    frames = times_of(trial)
    q, v, a = trial.motion.state(frames)
    rise = RigidBodyModel(trial.body.skeleton).centre_of_mass_acceleration(q, v, a)
    flying = trial.contacts.flight(frames)
    np.testing.assert_allclose(rise[flying] - [0.0, -9.80665, 0.0], 0.0, atol=1e-6)


def test_contact_forces_act_under_the_soles(trial):
    times = times_of(trial, 1000.0)
    reactions = trial.reactions(times)
    for stance in trial.contacts.stances:
        on = stance.covers(times) & (reactions.force_ground[:, stance.foot, 1] > LOADED)
        cop_sole = stance.to_sole(reactions.cop_ground[on, stance.foot])
        assert trial.body.sole.contains(cop_sole[:, [0, 2]]).all()
    assert np.abs(reactions.free_moment).max() < 20.0


def test_the_ground_pushes_and_rubs_within_reason(trial):
    force = trial.reactions(times_of(trial, 1000.0)).force_ground
    assert force[..., 1].min() > -0.01 * weight(trial)
    pressing = force[..., 1] > 0.25 * weight(trial)
    friction = np.hypot(force[..., 0], force[..., 2])[pressing] / force[..., 1][pressing]
    assert friction.max() < 0.6


def test_joints_stay_within_human_ranges(trial):
    q = np.degrees(trial.motion.derivative(times_of(trial), 0))
    for d, dof in enumerate(trial.motion.dofs):
        stem = dof[:-2] if dof.endswith(("_r", "_l")) else dof
        if stem in RANGES_DEG:
            low, high = RANGES_DEG[stem]
            assert low <= q[:, d].min(), dof
            assert q[:, d].max() <= high, dof


def test_standing_feet_stay_where_they_are_and_none_sinks_in(trial):
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
            assert np.abs(moved).max(initial=0) < 0.004
    assert planted > 100
    assert points[..., 1].min() > -0.006


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
