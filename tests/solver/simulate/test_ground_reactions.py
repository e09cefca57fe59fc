import numpy as np
import pytest

from solver.simulate.contacts import ContactPlan, Stance
from solver.simulate.sole import sole_of
from solver.simulate.trial import share_demand


def stance(foot, span, x, load):
    (start, end), side = span, 1 - 2 * foot
    return Stance(
        foot=foot,
        start=start,
        end=end,
        origin_ground=np.array([x, 0.0, 0.08 * side]),
        yaw=-0.1 * side,
        load=load,
        along=lambda t: np.full(len(t), 0.4),
        across=lambda t: np.full(len(t), 0.1),
        heel_planted=(start, end),
        forefoot_planted=(start, end),
    )


@pytest.fixture
def plan():
    def ramp_down(t):
        return 700 * np.clip((0.7 - t) / 0.2, 0, 1)

    def ramp_up(t):
        return 700 * np.clip((t - 0.5) / 0.2, 0, 1)

    stances = (stance(0, (0.0, 0.7), 0.0, ramp_down), stance(1, (0.5, 1.2), 0.6, ramp_up))
    return ContactPlan(stances, sole_of(1.75, None), brace=300.0)


@pytest.fixture
def demand():
    times = np.linspace(0.01, 1.19, 60)
    rng = np.random.default_rng(0)
    force = np.array([20.0, 700.0, -15.0]) + 30 * rng.normal(size=(60, 3))
    at = np.stack([0.3 + 0.01 * rng.normal(size=60), np.zeros(60), 0.01 * rng.normal(size=60)], axis=1)
    moment = np.cross(at, force)
    moment[:, 1] += 5 * rng.normal(size=60)
    return times, np.concatenate([force, moment], axis=1)


def test_the_feet_together_take_the_whole_demand(plan, demand):
    times, wanted = demand
    np.testing.assert_allclose(
        share_demand(wanted, plan, times).wrench_ground.sum(axis=1), wanted, atol=1e-10
    )


def test_acts_on_the_floor_as_force_and_vertical_moment_only(plan, demand):
    times, wanted = demand
    reactions = share_demand(wanted, plan, times)
    on = reactions.force_ground[..., 1] > 0
    assert (reactions.cop_ground[on][:, 1] == 0).all()
    moment = reactions.wrench_ground[..., 3:] - np.cross(
        np.nan_to_num(reactions.cop_ground), reactions.force_ground
    )
    np.testing.assert_allclose(moment[..., [0, 2]], 0, atol=1e-9)


def test_a_foot_off_the_ground_takes_nothing(plan, demand):
    times, wanted = demand
    reactions = share_demand(wanted, plan, times)
    assert (reactions.wrench_ground[times < 0.5, 1] == 0).all()
    assert np.isnan(reactions.cop_ground[times < 0.5, 1]).all()
    np.testing.assert_allclose(reactions.wrench_ground[times < 0.5, 0], wanted[times < 0.5], atol=1e-10)


def test_in_double_support_the_front_foot_brakes(plan, demand):
    times, wanted = demand
    reactions = share_demand(wanted, plan, times)
    both = (times > 0.55) & (times < 0.65)
    own = reactions.force_ground[both, :, 0] - wanted[both, :1] * plan.shares(times)[both]
    assert (own[:, 1] < -30).all()
    assert (own[:, 0] > 30).all()


def test_nothing_touches_the_ground_in_flight(plan):
    times = np.array([1.3, 1.4])
    reactions = share_demand(np.ones((2, 6)), plan, times)
    assert (reactions.wrench_ground == 0).all()
