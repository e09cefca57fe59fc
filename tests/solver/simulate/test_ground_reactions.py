"""What the ground has to give, and how the feet share it."""

import numpy as np
import pytest

from solver.simulate.contacts import ContactPlan, Stance
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.simulated_sole import sole_of
from solver.simulate.simulated_trial import share_demand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel


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


@pytest.fixture(scope="module")
def model():
    return RigidBodyModel(default_skeleton(mass_kg=68, height_m=1.7))


@pytest.fixture
def state(model):
    rng = np.random.default_rng(3)
    q, v, a = 0.4 * rng.normal(size=(3, 4, len(model.skeleton.dofs)))
    q[:, [model.skeleton.dofs.index(f"knee_angle_{s}") for s in "rl"]] = rng.uniform(0.2, 1.5, (4, 2))
    return q, 3 * v, 20 * a


def test_a_body_at_rest_demands_its_weight_below_its_centre_of_mass(model):
    skeleton = model.skeleton
    q = skeleton.default_q[None]
    R, p = body_poses(skeleton, q)
    com = (
        sum(b.mass * (p[0, i] + R[0, i] @ b.com_body) for i, b in enumerate(skeleton.bodies)) / skeleton.mass
    )
    wrench = GroundDemand(model).wrench(q, 0 * q, 0 * q)[0]
    weight = np.array([0, 68 * 9.80665, 0])
    np.testing.assert_allclose(wrench, [*weight, *np.cross(com, weight)], atol=1e-9)


def test_applied_to_any_body_it_leaves_the_root_without_residual(model, state):
    """Inverse dynamics by recursion knows nothing of centroidal momentum."""
    q, v, a = state
    wrench = GroundDemand(model).wrench(q, v, a)
    torques = model.inverse_dynamics(q, v, a, wrench[:, None], [model.skeleton.body_index("hand_l")])
    np.testing.assert_allclose(torques[:, :6], 0, atol=1e-8)


def test_slopes_are_those_of_finite_differences(model, state):
    demand = GroundDemand(model)
    about = np.array([[0.3, 0.1, -0.4]] * 4)

    def wrench(*state):
        w = demand.wrench(*state)
        return np.concatenate([w[:, :3], w[:, 3:] - np.cross(about, w[:, :3])], axis=1)

    table = demand.slopes(*state, about)
    np.testing.assert_allclose(table.wrench, wrench(*state), atol=1e-9)
    for i, slope in enumerate((table.by_q, table.by_v, table.by_a)):
        for d in range(len(model.skeleton.dofs)):
            up, down = [x.copy() for x in state], [x.copy() for x in state]
            up[i][:, d] += 1e-6
            down[i][:, d] -= 1e-6
            numeric = (wrench(*up) - wrench(*down)) / 2e-6
            np.testing.assert_allclose(slope[:, :, d], numeric, atol=2e-4, rtol=1e-5)
