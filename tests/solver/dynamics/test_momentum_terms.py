import numpy as np
import pytest

from solver.dynamics.momentum_terms import momentum_terms
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel


@pytest.fixture(scope="module")
def state(crane, crane_q):
    rng = np.random.default_rng(4)
    q = crane_q[::30]
    v, a = rng.normal(0, 1.5, q.shape), rng.normal(0, 8, q.shape)
    return q, v, a, rng.normal(0, 50, (len(q), 6))


def test_derivatives_match_finite_differences(crane, state):
    model = RigidBodyModel(crane)
    q, v, a, measured = state
    terms = momentum_terms(model, q, v, a, measured)
    step = 1e-6
    for j in range(q.shape[1]):
        shift = np.zeros_like(q)
        shift[:, j] = step
        for analytic, ahead, behind in (
            (terms.by_q, (q + shift, v, a), (q - shift, v, a)),
            (terms.by_v, (q, v + shift, a), (q, v - shift, a)),
            (terms.by_a, (q, v, a + shift), (q, v, a - shift)),
        ):
            numerical = (
                momentum_terms(model, *ahead, measured).residual
                - momentum_terms(model, *behind, measured).residual
            ) / (2 * step)
            np.testing.assert_allclose(analytic[:, :, j], numerical, rtol=1e-5, atol=1e-5)


def test_required_wrench_is_the_rate_of_momentum_of_the_bodies(crane, crane_q):
    """Newton and Euler from body positions alone, differenced in time."""
    rate = 2000.0
    t = np.arange(-3, 4) / rate
    start, speed, push = (
        crane_q[40],
        np.linspace(-1, 1, crane_q.shape[1]),
        np.linspace(3, -2, crane_q.shape[1]),
    )
    q = start + t[:, None] * speed + t[:, None] ** 2 / 2 * push
    R, o = body_poses(crane, q)
    masses = np.array([b.mass for b in crane.bodies])
    com_body = np.stack([o[:, b] + R[:, b] @ body.com_body for b, body in enumerate(crane.bodies)], axis=1)
    com = (masses[None, :, None] * com_body).sum(axis=1) / masses.sum()

    def difference(x):
        return (x[2:] - x[:-2]) * rate / 2

    linear = masses[None, :, None] * difference(com_body)
    spin = []
    for b, body in enumerate(crane.bodies):
        W = difference(R[:, b]) @ R[1:-1, b].transpose(0, 2, 1)
        omega = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=1)
        inertia = R[1:-1, b] @ body.inertia_body @ R[1:-1, b].transpose(0, 2, 1)
        spin.append((inertia @ omega[:, :, None])[:, :, 0])
    arm = com_body[1:-1] - com[1:-1, None]
    angular = np.cross(arm, linear).sum(axis=1) + np.sum(spin, axis=0)
    force = difference(linear.sum(axis=1))[1] - masses.sum() * crane.gravity
    moment = difference(angular)[1]
    terms = momentum_terms(RigidBodyModel(crane), start[None], speed[None], push[None], np.zeros((1, 6)))
    np.testing.assert_allclose(terms.residual[0], np.concatenate([force, moment]), atol=2e-3)
