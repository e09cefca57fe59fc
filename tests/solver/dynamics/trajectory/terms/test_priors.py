"""Terms of the shared parameters alone, as rows."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.inertia_parameters import inertia_parameters, prior_std
from solver.dynamics.trajectory.terms.priors import ExtraPrior, InertiaPrior
from solver.dynamics.trajectory.terms.term import SharedParameters
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters

SETTINGS = TrajectorySettings()
WEIGHT = 1.7
EXTRA = ExtraParameters(np.array([3.0, 0.4]), np.zeros(2))


def inertia_rows(case, shared):
    mass = case.inertias.skeleton_at(shared.phi).mass
    off_scale = (mass - case.skeleton.mass) / (SETTINGS.body_mass_std * case.skeleton.mass)
    return np.sqrt(WEIGHT) * np.append(shared.phi / prior_std(case.inertias, SETTINGS), off_scale)


CASES = {
    "inertias": (lambda c: InertiaPrior(c.inertias, WEIGHT, SETTINGS), inertia_rows),
    "extra": (lambda c: ExtraPrior(EXTRA), lambda c, shared: shared.x / EXTRA.prior_std),
}


@pytest.fixture(params=CASES)
def prior_and_rows(request, case):
    prior, rows = CASES[request.param]
    size = case.coefficients.size
    return prior(case), lambda vector: rows(
        case, case.at(np.concatenate([case.iterate[:size], vector])).shared
    )


def test_prior_is_that_of_dense_rows(case, prior_and_rows):
    prior, rows = prior_and_rows
    shared = case.at(case.iterate).shared
    R, J = rows(case.shared), case.derivatives(rows, case.shared)
    assert prior.cost(shared) == pytest.approx(R @ R, rel=1e-9)
    np.testing.assert_allclose(prior.gradient(shared), J.T @ R, atol=1e-7 * np.abs(J.T @ R).max())
    np.testing.assert_allclose(prior.curvature(shared), J.T @ J, atol=1e-7 * np.abs(J.T @ J).max())


def test_inertias_that_are_kept_have_no_place_in_the_vector(case):
    shared = replace(case.at(case.iterate).shared, inertias_free=False)
    inertias, extra = InertiaPrior(case.inertias, WEIGHT, SETTINGS), ExtraPrior(EXTRA)
    assert shared.count == len(shared.x)
    np.testing.assert_array_equal(inertias.gradient(shared), np.zeros(2))
    np.testing.assert_array_equal(inertias.curvature(shared), np.zeros((2, 2)))
    np.testing.assert_allclose(extra.gradient(shared), shared.x / EXTRA.prior_std**2)
    assert inertias.cost(shared) > 0


def test_counterparts_both_weigh(crane):
    """A step of φ that two arms share moves the body's mass by both."""
    arm, shoulder = crane.bodies[5], crane.joints[5]
    axes = tuple(replace(axis, coordinate="arm_angle_l") for axis in shoulder.axes)
    angle = replace(crane.coordinates[-1], name="arm_angle_l")
    two_armed = replace(
        crane,
        bodies=(*crane.bodies, replace(arm, name="arm_l")),
        joints=(*crane.joints, replace(shoulder, name="shoulder_l", axes=axes)),
        coordinates=(*crane.coordinates, angle),
    )
    inertias = inertia_parameters(two_armed)
    assert (inertias.group[5], len(inertias.names)) == (inertias.group[6], len(two_armed.bodies) - 1)
    prior = InertiaPrior(inertias, WEIGHT, SETTINGS)

    def at(phi):
        return SharedParameters(inertias, phi, np.zeros(0), inertias_free=True)

    phi = np.random.default_rng(5).normal(0, 0.02, inertias.count)
    moves = 1e-6 * np.eye(len(phi))
    numerical = [(prior.cost(at(phi + m)) - prior.cost(at(phi - m))) / 2e-6 for m in moves]
    np.testing.assert_allclose(2 * prior.gradient(at(phi)), numerical, atol=1e-6 * np.abs(numerical).max())
