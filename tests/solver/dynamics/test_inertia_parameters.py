from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.inertia_parameters import (
    inertia_parameters,
    prior_std,
    pseudo_inertia,
    required_wrench,
    wrench_by_parameters,
)
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.pinocchio_model import RigidBodyModel

SETTINGS = TrajectorySettings()


@pytest.fixture(scope="module")
def parameters(crane):
    return inertia_parameters(crane)


def test_nominal_at_zero(crane, parameters):
    J = parameters.pseudo_inertias(np.zeros(parameters.count))
    np.testing.assert_allclose(J, [pseudo_inertia(b) for b in crane.bodies], atol=1e-12)


def test_bodies_that_take_no_part_keep_their_inertia(crane):
    light = replace(crane.bodies[3], mass=0.05, inertia_body=np.diag([1e-5, 1e-5, 9e-5]))  # no rigid body's
    skeleton = replace(crane, bodies=(*crane.bodies[:3], light, *crane.bodies[4:]))
    parameters = inertia_parameters(skeleton)
    phi = np.random.default_rng(5).normal(0, 0.3, parameters.count)
    np.testing.assert_allclose(parameters.pseudo_inertias(phi)[3], pseudo_inertia(light))
    assert parameters.skeleton_at(phi).bodies[3] is light


def test_any_parameters_give_bodies_that_could_exist(parameters):
    phi = np.random.default_rng(0).normal(0, 1, parameters.count)
    for body in parameters.skeleton_at(phi).bodies:
        principal = np.linalg.eigvalsh(body.inertia_body)
        assert body.mass > 0
        assert principal[0] > 0
        assert principal[2] <= principal[0] + principal[1] + 1e-12


def test_derivatives_match_finite_differences(parameters):
    phi = np.random.default_rng(1).normal(0, 0.2, parameters.count)
    D = parameters.derivatives(phi)
    step = 1e-6
    for g in range(len(parameters.names)):
        for k in range(10):
            shift = np.zeros_like(phi)
            shift[10 * g + k] = step
            numerical = (
                parameters.pseudo_inertias(phi + shift) - parameters.pseudo_inertias(phi - shift)
            ) / (2 * step)
            for b in np.flatnonzero(parameters.group == g):
                np.testing.assert_allclose(D[b, k], numerical[b], atol=1e-8)


def test_counterparts_are_mirror_images(crane):
    left = replace(crane.bodies[1], name="femur_l", com_body=crane.bodies[1].com_body * (1, 1, -1))
    counterparts = replace(crane, bodies=(*crane.bodies[:5], left))
    parameters = inertia_parameters(counterparts)
    phi = np.random.default_rng(2).normal(0, 0.2, parameters.count)
    bodies = parameters.skeleton_at(phi).bodies
    mirror = np.diag([1, 1, -1])
    np.testing.assert_allclose(bodies[5].mass, bodies[1].mass)
    np.testing.assert_allclose(bodies[5].com_body, mirror @ bodies[1].com_body, atol=1e-12)
    np.testing.assert_allclose(bodies[5].inertia_body, mirror @ bodies[1].inertia_body @ mirror, atol=1e-12)


def test_wrench_from_material_points_equals_pinocchios_rate_of_momentum(crane, crane_q, parameters):
    rng = np.random.default_rng(3)
    q = crane_q[::20]
    v, a = rng.normal(0, 2, q.shape), rng.normal(0, 10, q.shape)
    kinematics = ForwardKinematics(crane)
    A, T = material_accelerations(kinematics, kinematics.poses(q), q, v, a)
    phi = rng.normal(0, 0.1, parameters.count)
    wrench = required_wrench(A, T, parameters.pseudo_inertias(phi)).sum(axis=1)
    changed = RigidBodyModel(parameters.skeleton_at(phi))
    terms = momentum_terms(changed, q, v, a, np.zeros((len(q), 6)))
    np.testing.assert_allclose(wrench[:, :3], terms.residual[:, :3], atol=1e-8)
    about_com = wrench[:, 3:] - np.cross(terms.com_ground, wrench[:, :3])
    np.testing.assert_allclose(about_com, terms.residual[:, 3:], atol=1e-8)


def test_the_wrenchs_derivative_by_the_parameters(crane, crane_q, parameters):
    rng = np.random.default_rng(4)
    q = crane_q[::20]
    v, a = rng.normal(0, 2, q.shape), rng.normal(0, 10, q.shape)
    kinematics = ForwardKinematics(crane)
    A, T = material_accelerations(kinematics, kinematics.poses(q), q, v, a)
    phi = rng.normal(0, 0.1, parameters.count)
    analytic = wrench_by_parameters(A, T, parameters, parameters.derivatives(phi))
    for k in range(parameters.count):
        shift = 1e-6 * np.eye(parameters.count)[k]
        ahead, behind = (
            required_wrench(A, T, parameters.pseudo_inertias(p)).sum(axis=1)
            for p in (phi + shift, phi - shift)
        )
        np.testing.assert_allclose(analytic[:, :, k], (ahead - behind) / 2e-6, atol=1e-5)


def test_a_step_is_taken_in_the_pseudo_inertias(parameters):
    rng = np.random.default_rng(6)
    phi, step = rng.normal(0, 0.1, parameters.count), rng.normal(0, 0.05, parameters.count)
    J, D = parameters.pseudo_inertias(phi), parameters.derivatives(phi)
    change = np.einsum("bk,bkij->bij", step.reshape(-1, 10)[parameters.group], D)
    inside = parameters.group >= 0
    moved = parameters.pseudo_inertias(parameters.moved(phi, step, J, D))
    expected = J + change
    np.testing.assert_allclose(moved[inside], expected[inside], atol=1e-10)


def test_a_step_to_a_body_that_could_not_exist_is_taken_in_the_parameters(parameters):
    step = np.zeros(parameters.count)
    step[9] = -0.8  # of the mass's logarithm: its square root would be 1 − 2 · 0.8
    phi = np.zeros(parameters.count)
    moved = parameters.moved(phi, step, parameters.pseudo_inertias(phi), parameters.derivatives(phi))
    np.testing.assert_allclose(moved, step, atol=1e-12)


def test_prior_of_a_segment_is_the_stated_scatter(parameters):
    phi = np.zeros(parameters.count)
    std = prior_std(parameters, SETTINGS)
    mass_entry = 9
    phi[mass_entry] = std[mass_entry]
    body = int(np.flatnonzero(parameters.group == 0)[0])
    before, after = parameters.skeleton.bodies[body], parameters.skeleton_at(phi).bodies[body]
    assert after.mass / before.mass - 1 == pytest.approx(SETTINGS.mass_std, rel=0.05)
