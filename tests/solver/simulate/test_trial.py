import numpy as np
import pytest

from solver.simulate.person import Person, body_of
from solver.simulate.trajectory_fit import FootPoints
from solver.simulate.trial import Scenario, simulate_trial
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.segment_tables import RANGES_DEG

LOADED = 30.0  # [N]


def weight(trial):
    return trial.body.skeleton.mass * 9.80665


def frame_times(trial, rate=100.0):
    return np.arange(round(trial.scenario.duration * rate) + 1) / rate


def root_residual(trial, times, q, v, a):
    """Generalized forces of the root that the feet's wrenches leave, by recursive Newton-Euler."""
    skeleton = trial.body.skeleton
    feet = [skeleton.body_index(f"calcn_{side}") for side in "rl"]
    wrenches = trial.reactions(times).wrench_ground
    return RigidBodyModel(skeleton).inverse_dynamics(q, v, a, wrenches, feet)[:, :6]


def test_force_is_mass_times_acceleration_at_every_frame(trial):
    times = frame_times(trial)
    residual = root_residual(trial, times, *trial.motion.state(times))
    assert np.abs(residual).max() < 1e-6 * weight(trial)


def test_and_from_the_sampled_frames_alone(trial):
    """Through the quintic spline that everyone derives accelerations from, away from its free ends."""
    motion = trial.frames(100.0)
    residual = root_residual(trial, motion.times, motion.q, motion.velocity, motion.acceleration)
    assert np.abs(residual[10:-10]).max() < 1.0


def test_and_between_frames_to_a_percent_of_body_weight(run):
    """Flight is weightless at the frames; between them a polynomial remainder stays."""
    times = frame_times(run, 1000.0)
    remainder = run.demand(times)[run.contacts.flight(times), :3]
    assert np.abs(remainder).max() < 0.01 * weight(run)
    assert np.sqrt(np.mean(remainder**2)) < 0.002 * weight(run)


def test_loaded_feet_are_pressed_within_their_soles(trial):
    times = frame_times(trial, 500.0)
    reactions = trial.reactions(times)
    for stance in trial.contacts.stances:
        on = stance.covers(times) & (reactions.force_ground[:, stance.foot, 1] > LOADED)
        cop_sole = stance.to_sole(reactions.cop_ground[on, stance.foot])
        assert trial.body.sole.contains(cop_sole[:, [0, 2]]).all()


def test_the_ground_pushes_and_rubs_within_reason(trial):
    times = frame_times(trial, 500.0)
    force = trial.reactions(times).force_ground
    assert force[..., 1].min() > -0.005 * weight(trial)  # the polynomial remainder around flight
    loaded = force[..., 1] > LOADED
    friction = np.hypot(force[..., 0], force[..., 2])[loaded] / force[..., 1][loaded]
    assert friction.max() < 0.5
    assert np.abs(trial.reactions(times).free_moment).max() < 10.0


def test_standing_feet_stay_where_they_are(trial):
    times = frame_times(trial, 500.0)
    feet = FootPoints(trial.body.skeleton, trial.body.sole)
    points = feet.positions(trial.motion.derivative(times, 0))
    for stance in trial.contacts.stances:
        for k, body in enumerate(feet.body_names):
            since, until = stance.heel_planted if body == "calcn" else stance.forefoot_planted
            on = (times > since + 0.01) & (times < until - 0.01)
            moved = points[on, stance.foot, k] - stance.to_ground(feet.flat_sole[k])
            assert np.abs(moved).max(initial=0) < 0.003
    assert points[..., 1].min() > -0.005


def test_joints_stay_within_human_ranges(trial):
    q = np.degrees(trial.motion.derivative(frame_times(trial), 0))
    for d, dof in enumerate(trial.motion.dofs):
        stem = dof[:-2] if dof.endswith(("_r", "_l")) else dof
        if stem in RANGES_DEG:
            low, high = RANGES_DEG[stem]
            assert low <= q[:, d].min(), dof
            assert q[:, d].max() <= high, dof


def test_walking_has_double_support_and_two_humps(walk):
    times = frame_times(walk, 500.0)
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
    times = frame_times(walk)
    places = [walk.motion.dofs.index(f"pelvis_t{axis}") for axis in "xz"]
    path = walk.motion.derivative(times, 0)[:, places]
    heading = np.radians(25.0)
    travelled = (path[-1] - path[0]) @ np.array([np.cos(heading), -np.sin(heading)])
    assert travelled / 2.4 == pytest.approx(1.3, rel=0.05)
    assert np.abs(path @ np.array([np.sin(heading), np.cos(heading)])).max() < 0.1


def test_running_flies_between_steps_of_two_and_a_half_body_weights(run):
    times = frame_times(run, 500.0)
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
    knee = np.degrees(
        squat.motion.derivative(frame_times(squat), 0)[:, squat.motion.dofs.index("knee_angle_r")]
    )
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
    times = frame_times(trial)
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
