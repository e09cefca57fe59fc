import numpy as np
import pytest

from solver.simulate.ground_demand import GroundDemand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel


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
