"""Extra wrenches and columns in the border of the trajectory fit."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import FitError
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.trajectory.spline_band import from_blocks, in_blocks
from solver.dynamics.trajectory.terms.root_residual import RootResidual
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_search import extra_covariance
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import State, TrajectorySolver
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions
from solver.skeleton.pinocchio_model import RigidBodyModel

RATE = 50.0
FRAMES = 40
SETTINGS = TrajectorySettings(knot_spacing_s=0.04)
PRIOR = ExtraParameters(prior_std=np.array([50.0, 0.4]), start=np.zeros(2))
TRUE_X = np.array([30.0, -0.25])


def required(skeleton, motion):
    """Force and moment about the ground origin, frame by frame."""
    nothing = np.zeros((motion.frames, 6))
    terms = momentum_terms(RigidBodyModel(skeleton), motion.q, motion.velocity, motion.acceleration, nothing)
    wrench = terms.residual.copy()
    wrench[:, 3:] += np.cross(terms.com_ground, wrench[:, :3])
    return wrench


def columns_of(rng):
    """A push along x at a moving point, and a share of an arbitrary wrench."""
    t = np.arange(FRAMES) / RATE
    push = np.zeros((FRAMES, 6))
    push[:, 0] = 1 + np.sin(9 * t)
    point = np.stack([0.3 + t, 1.0 + 0.1 * np.cos(5 * t), 0.2 * t], axis=1)
    push[:, 3:] = np.cross(point, push[:, :3])
    other = 20 * np.cumsum(rng.normal(size=(FRAMES, 6)), axis=0) / np.sqrt(FRAMES)
    return np.stack([push, other], axis=2)


@pytest.fixture(scope="module")
def trial(crane, crane_q):
    """A motion under forces of which a constant and two columns were not recorded."""
    rng = np.random.default_rng(11)
    motion = Motion(crane.dofs, crane_q[:FRAMES], RATE)
    observed = marker_positions(crane, motion.q)
    noisy = observed + rng.normal(0, 0.001, observed.shape)
    columns, fixed = columns_of(rng), rng.normal(0, 5, 6) * np.ones((FRAMES, 6))
    recorded = required(crane, motion) - fixed - columns @ TRUE_X
    counts = np.ones(FRAMES, dtype=bool)
    counts[20:24] = False
    return TrialData(noisy, recorded, counts, motion, extra_wrench_ground=fixed, extra_columns_ground=columns)


@pytest.fixture(scope="module")
def fitted(crane, trial):
    return fit_trajectories(crane, [trial], SETTINGS, extra=PRIOR)


def test_a_known_x_comes_back(fitted):
    std = np.sqrt(np.diag(fitted.extra_covariance))
    assert np.all(std < 0.2 * np.abs(TRUE_X))
    assert np.all(np.abs(fitted.extra - TRUE_X) < 3 * std)


def test_a_fixed_wrench_is_the_same_as_one_that_was_recorded(crane, trial, fitted):
    together = replace(
        trial, wrench_ground=trial.wrench_ground + trial.extra_wrench_ground, extra_wrench_ground=None
    )
    other = fit_trajectories(crane, [together], SETTINGS, extra=PRIOR)
    np.testing.assert_allclose(other.extra, fitted.extra, rtol=1e-9)
    np.testing.assert_allclose(other.motions[0].q, fitted.motions[0].q, atol=1e-10)


def test_gradient_by_x_is_that_of_the_cost(crane, trial):
    solver = TrajectorySolver(crane, [trial], SETTINGS, PRIOR)
    c, x = solver.begun(None).coefficients[0], np.array([12.0, 0.1])
    state = state_at(solver, c, x)
    (system,) = solver.linearized(state)
    analytic = 2 * solver.gradient_of(state, [system]).shared[solver.inertias.count :]
    for k, step in enumerate((1e-3, 1e-5)):
        ahead, behind = (state_at(solver, c, x + sign * step * np.eye(2)[k]) for sign in (1, -1))
        numerical = (solver.cost(ahead) - solver.cost(behind)) / (2 * step)
        assert analytic[k] == pytest.approx(numerical, rel=1e-6)


def test_the_step_and_the_covariance_are_those_of_a_dense_solve(crane, trial):
    """Rows by finite differences of the whitened residual; markers, jerk and priors from the band itself."""
    solver = TrajectorySolver(crane, [trial], SETTINGS, PRIOR)
    c = solver.begun(None).coefficients[0]
    state = state_at(solver, c, np.array([12.0, 0.1]))
    (system,) = solver.linearized(state)
    inertias, size = solver.inertias.count, c.size
    matrix = system.band.block_tridiagonal()
    unit = np.eye(size).reshape(*c.shape, size)
    band = from_blocks(matrix.times(in_blocks(unit)), *c.shape).reshape(size, size)
    prior_curvature = sum(prior.curvature(state.shared) for prior in solver.priors)
    prior_gradient = sum(prior.gradient(state.shared) for prior in solver.priors)
    border = system.border.reshape(size, -1)
    dense = np.block([[band, border], [border.T, system.corner + prior_curvature]])
    gradient = np.concatenate([system.gradient.coefficients.ravel(), system.gradient.shared + prior_gradient])
    step = -np.linalg.solve(dense, gradient)
    factor = solver.factorized(state, [system])
    tried = solver.stepped(state, factor.step(solver.gradient_of(state, [system])))
    scale = np.abs(step[size + inertias :])
    np.testing.assert_allclose(
        tried.shared.x - state.shared.x, step[size + inertias :], atol=1e-6 * scale.max()
    )
    covariance = np.linalg.inv(dense)[size + inertias :, size + inertias :]
    np.testing.assert_allclose(extra_covariance(state.shared, factor.corner), covariance, rtol=1e-6)


def test_the_border_of_x_is_the_derivative_of_the_gradient(crane, trial):
    """Gauss-Newton's border: Jᵀ ∂r/∂x; r is linear in x, and for a robust scale far off nothing else is."""
    settings = replace(SETTINGS, residual_robust_scale=1e6)
    solver = TrajectorySolver(crane, [trial], settings, PRIOR)
    part, inertias = solver.parts[0], solver.inertias.count
    c, x, rng = solver.begun(None).coefficients[0], np.zeros(2), np.random.default_rng(2)
    term = RootResidual(trial, settings)
    direction = rng.normal(size=c.shape)
    (system,) = solver.linearized(state_at(solver, c, x))
    border = np.einsum("cd,cdp->p", direction, system.border)[inertias:]

    def residual(coefficients, x):
        at = part.point(coefficients, state_at(solver, c, x).shared)
        (states,) = at.chunks
        return np.sqrt(at.frame_weight) * term.rows(at.shared, states).value

    h = 1e-6
    along = (residual(c + h * direction, x) - residual(c - h * direction, x)) / (2 * h)
    for k in range(2):
        by_x = residual(c, x + np.eye(2)[k]) - residual(c, x)
        assert border[k] == pytest.approx(float((along * by_x).sum()), rel=1e-5)


def test_without_columns_the_fit_is_the_one_it_was(crane, trial):
    plain = replace(trial, extra_wrench_ground=None, extra_columns_ground=None)
    alone = fit_trajectories(crane, [plain], SETTINGS)
    absent = fit_trajectories(crane, [plain], SETTINGS, extra=PRIOR)
    assert alone.extra.shape == (0,)
    np.testing.assert_allclose(absent.extra, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diag(absent.extra_covariance)), PRIOR.prior_std)
    np.testing.assert_allclose(absent.motions[0].q, alone.motions[0].q, atol=1e-12)


def test_trials_share_x(crane, trial):
    """Two that say the same say it more surely."""
    one = fit_trajectories(crane, [trial], SETTINGS, extra=PRIOR)
    two = fit_trajectories(crane, [trial, trial], SETTINGS, extra=PRIOR)
    assert np.all(np.diag(two.extra_covariance) < np.diag(one.extra_covariance))
    assert np.all(np.abs(two.extra - TRUE_X) < 3 * np.sqrt(np.diag(two.extra_covariance)))


def test_columns_and_parameters_must_be_as_many(crane, trial):
    with pytest.raises(FitError, match="extra columns"):
        fit_trajectories(crane, [trial], SETTINGS)


def state_at(solver, coefficients, x):
    return State([coefficients], solver.shared(np.zeros(solver.inertias.count), x))
