"""Dynamics behind the coupling map, against mechanics rather than against another program."""

import numpy as np
import pytest

from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel


@pytest.fixture
def motion(crane, crane_q):
    rng = np.random.default_rng(9)
    q = crane_q[:6]
    return q, rng.normal(size=q.shape), rng.normal(size=q.shape)


def mass_matrix(model, q):
    """The torques of unit accelerations, less those without any."""
    still = np.zeros_like(q)
    resting = model.inverse_dynamics(q, still, still)
    units = np.eye(q.shape[1])
    return np.stack([model.inverse_dynamics(q, still, still + e) - resting for e in units], axis=2)


def test_bodies_stand_where_forward_kinematics_puts_them(crane, crane_q):
    R, p = RigidBodyModel(crane).body_placements(crane_q)
    expected_R, expected_p = body_poses(crane, crane_q)
    np.testing.assert_allclose(R, expected_R, atol=1e-12)
    np.testing.assert_allclose(p, expected_p, atol=1e-12)


def test_the_mass_matrix_gives_the_kinetic_energy_of_the_bodies(crane, motion):
    q, v, _ = motion
    h = 1e-5
    (R1, p1), (R0, p0) = body_poses(crane, q + h * v), body_poses(crane, q - h * v)
    R, _ = body_poses(crane, q)
    energy = np.zeros(len(q))
    for i, body in enumerate(crane.bodies):
        com_velocity = (p1[:, i] + R1[:, i] @ body.com_body - p0[:, i] - R0[:, i] @ body.com_body) / (2 * h)
        spin = np.einsum("tji,tjk->tik", R[:, i], (R1[:, i] - R0[:, i]) / (2 * h))
        omega_body = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        energy += body.mass * (com_velocity**2).sum(axis=1) / 2
        energy += np.einsum("ti,ij,tj->t", omega_body, body.inertia_body, omega_body) / 2
    M = mass_matrix(RigidBodyModel(crane), q)
    np.testing.assert_allclose(np.einsum("ti,tij,tj->t", v, M, v) / 2, energy, rtol=1e-7)
    np.testing.assert_allclose(M, M.transpose(0, 2, 1), atol=1e-12)


def test_torques_do_the_work_that_the_energy_gains(crane, motion):
    """d/dt (½ q̇ᵀM q̇ + potential) = q̇ᵀτ along any path."""
    q, v, a = motion
    model, h = RigidBodyModel(crane), 1e-5

    def energy(time):
        at, rate = q + time * v + time**2 / 2 * a, v + time * a
        height = model.centre_of_mass(at) @ -crane.gravity
        return np.einsum("ti,tij,tj->t", rate, mass_matrix(model, at), rate) / 2 + crane.mass * height

    power = (model.inverse_dynamics(q, v, a) * v).sum(axis=1)
    np.testing.assert_allclose(power, (energy(h) - energy(-h)) / (2 * h), rtol=1e-6)


def test_an_external_wrench_takes_off_the_torques_that_do_its_virtual_work(crane, motion):
    q, v, a = motion
    model, foot, h = RigidBodyModel(crane), crane.body_index("foot_r"), 1e-6
    rng = np.random.default_rng(10)
    force, point_body = rng.normal(size=(len(q), 3)), np.array([0.1, -0.05, 0.02])

    def point(at):
        R, p = body_poses(crane, at)
        return R[:, foot] @ point_body + p[:, foot]

    wrench = np.concatenate([force, np.cross(point(q), force)], axis=1)[:, None]
    relief = model.inverse_dynamics(q, v, a) - model.inverse_dynamics(q, v, a, wrench, [foot])
    for i, unit in enumerate(np.eye(q.shape[1])):
        moved = (point(q + h * unit) - point(q - h * unit)) / (2 * h)
        np.testing.assert_allclose(relief[:, i], (moved * force).sum(axis=1), atol=1e-8)


def test_the_root_force_carries_the_centre_of_mass(crane, motion):
    q, v, a = motion
    model = RigidBodyModel(crane)
    translations = [crane.dofs.index(name) for name in ("tx", "ty", "tz")]
    force = model.inverse_dynamics(q, v, a)[:, translations]
    acceleration = model.centre_of_mass_acceleration(q, v, a)
    np.testing.assert_allclose(force, crane.mass * (acceleration - crane.gravity), atol=1e-9)
    h = 1e-4
    path = [model.centre_of_mass(q + s * h * v + (s * h) ** 2 / 2 * a) for s in (-1, 0, 1)]
    np.testing.assert_allclose(acceleration, (path[0] - 2 * path[1] + path[2]) / h**2, atol=1e-5)


def test_the_angular_momentum_is_that_of_the_bodies(crane, motion):
    q, v, _ = motion
    h = 1e-5
    (R1, p1), (R0, p0) = body_poses(crane, q + h * v), body_poses(crane, q - h * v)
    R, p = body_poses(crane, q)
    model = RigidBodyModel(crane)
    centre, angular = model.centroidal_momentum(q, v)
    np.testing.assert_allclose(centre, model.centre_of_mass(q), atol=1e-12)
    expected = np.zeros((len(q), 3))
    for i, body in enumerate(crane.bodies):
        place = p[:, i] + R[:, i] @ body.com_body
        speed = (p1[:, i] + R1[:, i] @ body.com_body - p0[:, i] - R0[:, i] @ body.com_body) / (2 * h)
        spin = (R1[:, i] - R0[:, i]) @ R[:, i].transpose(0, 2, 1) / (2 * h)
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        inertia = R[:, i] @ body.inertia_body @ R[:, i].transpose(0, 2, 1)
        expected += body.mass * np.cross(place - centre, speed) + (inertia @ omega[..., None])[..., 0]
    np.testing.assert_allclose(angular, expected, atol=1e-8)


def test_no_frames_give_no_torques(crane):
    empty = np.zeros((0, len(crane.dofs)))
    model = RigidBodyModel(crane)
    assert model.inverse_dynamics(empty, empty, empty).shape == empty.shape
    assert model.centre_of_mass(empty).shape == (0, 3)


def test_derivatives_of_torques_match_finite_differences(crane, motion):
    model = RigidBodyModel(crane)
    q, v, a = (x[::2] for x in motion)
    rng = np.random.default_rng(8)
    feet = [len(crane.bodies) - 1, len(crane.bodies) // 2]
    wrenches = rng.normal(0, 50, (len(q), 2, 6))
    found = model.inverse_dynamics_derivatives(q, v, a, wrenches, feet)
    step = 1e-6
    for order in range(3):
        for j in range(q.shape[1]):
            ahead, behind = [[q.copy(), v.copy(), a.copy()] for _ in range(2)]
            ahead[order][:, j] += step
            behind[order][:, j] -= step
            torques = (model.inverse_dynamics(*state, wrenches, feet) for state in (ahead, behind))
            numerical = np.subtract(*torques) / (2 * step)
            np.testing.assert_allclose(found[:, :, order, j], numerical, rtol=1e-5, atol=1e-5)


def test_the_centre_of_mass_moves_with_its_jacobian(crane, crane_q):
    model, q, step = RigidBodyModel(crane), crane_q[::30], 1e-6
    found = model.centre_of_mass_jacobian(q)
    for j, shift in enumerate(step * np.eye(q.shape[1])):
        moved = model.centre_of_mass(q + shift) - model.centre_of_mass(q - shift)
        np.testing.assert_allclose(found[:, :, j], moved / (2 * step), atol=1e-8)
