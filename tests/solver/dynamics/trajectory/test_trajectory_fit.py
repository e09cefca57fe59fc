from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.trajectory import trajectory_solver
from solver.dynamics.trajectory.spline_band import CoefficientBand, from_blocks, in_blocks
from solver.dynamics.trajectory.spline_basis import spline_basis
from solver.dynamics.trajectory.terms import term
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import State, TrajectorySolver
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions
from solver.skeleton.pinocchio_model import RigidBodyModel

RATE = 50.0
SETTINGS = TrajectorySettings(knot_spacing_s=0.04)


def required(skeleton, motion):
    """Force and moment about the ground origin, frame by frame."""
    model = RigidBodyModel(skeleton)

    terms = momentum_terms(
        model, motion.q, motion.velocity, motion.acceleration, np.zeros((motion.frames, 6))
    )
    wrench = terms.residual.copy()
    wrench[:, 3:] += np.cross(terms.com_ground, wrench[:, :3])
    return wrench


@pytest.fixture(scope="module")
def light_capped(crane):
    """With a cap too light for its inertia to be fitted."""
    cap = replace(crane.bodies[3], mass=0.1)
    return replace(crane, bodies=(*crane.bodies[:3], cap, *crane.bodies[4:]))


@pytest.fixture(scope="module")
def trial(light_capped, crane_q):
    rng = np.random.default_rng(7)
    motion = Motion(light_capped.dofs, crane_q[:60], RATE)
    observed = marker_positions(light_capped, motion.q) + rng.normal(
        0, 0.002, (60, len(light_capped.markers), 3)
    )
    observed[10:14, 3] = np.nan
    counts = np.ones(60, dtype=bool)
    counts[25:35] = False
    noisy = Motion(light_capped.dofs, motion.q + rng.normal(0, 0.01, motion.q.shape), RATE)
    return TrialData(observed, required(light_capped, motion), counts, noisy)


def test_band_equals_the_dense_sum_over_frames():
    basis = spline_basis(17, RATE, 2)
    rng = np.random.default_rng(0)
    dofs = 3
    H = rng.normal(size=(17, dofs, dofs))
    H = H + H.transpose(0, 2, 1)
    X = rng.normal(size=(16, dofs, dofs))
    rows = [rng.normal(size=(17, 6, dofs)) for _ in range(3)]
    value, phi = rng.normal(size=(17, 6)), rng.normal(size=(17, 6, 4))
    band = CoefficientBand.empty(basis, dofs)
    before = np.concatenate([np.zeros((1, dofs, dofs)), X])
    for at in (slice(0, 6), slice(6, 17)):
        band.add_frames(at.start, H[at], before[at])
    products = np.zeros((basis.coefficients, dofs, 5))
    for at in (slice(0, 6), slice(6, 17)):
        beside = np.concatenate([value[at, :, None], phi[at]], axis=2)
        band.add_residual_rows(at.start, [J[at] for J in rows], beside, products)
    gradient, border = products[:, :, 0], products[:, :, 1:]
    band.add_jerk(np.array([1.0, 2.0, 3.0]) * 1e-6)

    count = basis.coefficients
    B = np.zeros((3, 17, count))
    for order in range(3):
        for t in range(17):
            B[order, t, basis.first[t] : basis.first[t] + 6] = basis.derivative[order][t]
    dense = np.zeros((count, dofs, count, dofs))
    for t in range(17):
        dense += np.einsum("a,b,ij->aibj", B[0, t], B[0, t], H[t])
    for i in range(16):
        cross = np.einsum("a,b,ij->aibj", B[0, i + 1], B[0, i], X[i])
        dense += cross + cross.transpose(2, 3, 0, 1)
    R = sum(np.einsum("ta,trj->traj", B[k], rows[k]) for k in range(3))
    dense += np.einsum("traj,trbk->ajbk", R, R)
    for k in range(6):
        for a in range(count - k):
            for j in range(dofs):
                dense[a, j, a + k, j] += basis.jerk_gram[a, k] * (j + 1) * 1e-6
                if k:
                    dense[a + k, j, a, j] += basis.jerk_gram[a, k] * (j + 1) * 1e-6
    matrix = band.block_tridiagonal()
    x = rng.normal(size=(count, dofs, 2))
    product = from_blocks(matrix.times(in_blocks(x)), count, dofs)
    np.testing.assert_allclose(product, np.einsum("aibj,bjc->aic", dense, x), atol=1e-9)
    np.testing.assert_allclose(gradient, np.einsum("traj,tr->aj", R, value), atol=1e-10)
    np.testing.assert_allclose(border, np.einsum("traj,trp->ajp", R, phi), atol=1e-10)


def test_gradient_of_the_whole_cost_matches_finite_differences(light_capped, trial):
    solver = TrajectorySolver(light_capped, [trial], SETTINGS)
    part = solver.parts[0]
    rng = np.random.default_rng(1)
    c = solver.begun(None).coefficients[0]
    phi = rng.normal(0, 0.02, solver.inertias.count)
    shared = solver.shared(phi, np.zeros(0))
    system = part.linearized(part.point(c, shared))

    def cost(coefficients, phi=phi):
        return part.cost(part.point(coefficients, solver.shared(phi, np.zeros(0))))

    for _ in range(4):
        direction = rng.normal(size=c.shape)
        direction /= np.abs(direction).max()
        step = 1e-6
        numerical = (cost(c + step * direction) - cost(c - step * direction)) / (2 * step)
        analytic = 2 * (system.gradient.coefficients * direction).sum()
        assert numerical == pytest.approx(analytic, rel=1e-4)
    direction = rng.normal(size=phi.shape)
    step = 1e-6
    numerical = (cost(c, phi + step * direction) - cost(c, phi - step * direction)) / (2 * step)
    assert numerical == pytest.approx(2 * (system.gradient.shared @ direction), rel=1e-5)


def test_the_fit_obeys_the_forces_and_stays_at_the_markers(light_capped, trial):
    fit = fit_trajectories(light_capped, [trial], SETTINGS)
    motion = fit.motions[0]
    residual = required(fit.skeleton, motion) - trial.wrench_ground
    inner = trial.counts.copy()
    inner[:5] = inner[-5:] = False
    before = required(light_capped, trial.start) - trial.wrench_ground
    assert np.sqrt((residual[inner, :3] ** 2).mean()) < 0.05 * np.sqrt((before[inner, :3] ** 2).mean())
    error = np.linalg.norm(marker_positions(fit.skeleton, motion.q) - trial.observed_ground, axis=2)
    assert np.sqrt(np.nanmean(error**2)) < 0.006


def test_hidden_frames_stay_near_the_truth_and_do_not_jump(light_capped, crane_q, trial):
    motion = fit_trajectories(light_capped, [trial], SETTINGS).motions[0]
    truth = Motion(light_capped.dofs, crane_q[:60], RATE)
    error = np.abs(motion.acceleration - truth.acceleration)
    assert error[25:35].max() < 3 * error[8:52][trial.counts[8:52]].max() + 1.0


def test_what_repeats_teaches_inertias_no_more_than_once(light_capped, trial, monkeypatch):
    """Beyond the time in which inertias are learnt, three times the same stride says what one says."""
    known_s = trial.counts.sum() / RATE
    monkeypatch.setattr(trajectory_solver, "INERTIA_LESSON_S", known_s)
    once = fit_trajectories(light_capped, [trial], SETTINGS).phi
    np.testing.assert_allclose(fit_trajectories(light_capped, [trial] * 3, SETTINGS).phi, once, atol=1e-9)
    monkeypatch.setattr(trajectory_solver, "INERTIA_LESSON_S", 3 * known_s)
    thrice = fit_trajectories(light_capped, [trial] * 3, SETTINGS).phi
    assert np.linalg.norm(thrice) > 1.5 * np.linalg.norm(once)


def test_same_input_same_output(light_capped, trial):
    first, second = (fit_trajectories(light_capped, [trial], SETTINGS) for _ in range(2))
    np.testing.assert_array_equal(first.motions[0].q, second.motions[0].q)


def test_the_cost_falls_from_iteration_to_iteration(light_capped, trial):
    fit = fit_trajectories(light_capped, [trial], SETTINGS)
    assert len(fit.costs) == fit.iterations + 1
    assert all(later < earlier for earlier, later in pairwise(fit.costs))


def test_a_search_that_begins_where_one_ended_ends_with_its_first_step(light_capped, trial):
    settings = replace(SETTINGS, tolerance=1e-9)
    first = fit_trajectories(light_capped, [trial], settings)
    begun = replace(trial, spline=first.splines[0])
    again = fit_trajectories(light_capped, [begun], SETTINGS, phi=first.phi)
    assert first.iterations > 1
    assert again.iterations == 1
    np.testing.assert_allclose(again.motions[0].q, first.motions[0].q, atol=1e-4)
    np.testing.assert_allclose(again.phi, first.phi, atol=1e-3)


def test_the_predicted_decrease_is_the_quadratic_models(light_capped, trial):
    """2 gᵀs + sᵀHs with H s = −g is gᵀs; the gradient here by central differences of the whole cost."""
    solver = TrajectorySolver(light_capped, [trial], SETTINGS)
    fit = fit_trajectories(light_capped, [trial], replace(SETTINGS, iterations=1))
    state = state_at(solver, fit.splines[0], fit.phi)
    system = solver.linearized(state)
    step = solver.factorized(state, system).step(solver.gradient_of(state, system))

    def cost(h):
        moved = state.coefficients[0] + h * step.coefficients[0]
        return solver.cost(state_at(solver, moved, fit.phi + h * step.shared))

    slope = (cost(1e-4) - cost(-1e-4)) / 2e-4
    np.testing.assert_allclose(step.predicted, -slope / 2, rtol=1e-4)


def test_the_gradient_alone_is_that_of_the_whole_system(light_capped, trial):
    solver = TrajectorySolver(light_capped, [trial], SETTINGS)
    rng = np.random.default_rng(3)
    state = state_at(solver, solver.begun(None).coefficients[0], rng.normal(0, 0.02, solver.inertias.count))
    alone, whole = solver.gradient(state), solver.gradient_of(state, solver.linearized(state))
    scale = np.abs(whole.coefficients[0]).max()
    np.testing.assert_allclose(alone.coefficients[0], whole.coefficients[0], atol=1e-12 * scale)
    np.testing.assert_allclose(alone.shared, whole.shared, rtol=1e-10)
    assert alone.cost == pytest.approx(solver.cost(state), rel=1e-12)


def test_cost_and_system_are_the_same_whatever_the_chunks(light_capped, trial, monkeypatch):
    solver = TrajectorySolver(light_capped, [trial], SETTINGS)
    state = state_at(solver, solver.begun(None).coefficients[0], np.zeros(solver.inertias.count))
    ((whole,), cost) = solver.linearized(state), solver.cost(state)
    monkeypatch.setattr(term, "CHUNK", 7)
    ((chunked,), again) = solver.linearized(state), solver.cost(state)
    assert again == pytest.approx(cost, rel=1e-12)
    assert chunked.gradient.cost + solver.prior_cost(state) == pytest.approx(cost, rel=1e-12)
    pairs = (
        (whole.gradient.coefficients, chunked.gradient.coefficients),
        (whole.gradient.shared, chunked.gradient.shared),
        (whole.border, chunked.border),
        (whole.corner, chunked.corner),
    )
    for one, other in pairs:
        np.testing.assert_allclose(other, one, atol=1e-10 * np.abs(one).max())
    np.testing.assert_allclose(
        chunked.band.panels, whole.band.panels, atol=1e-12 * np.abs(whole.band.panels).max()
    )


def state_at(solver, coefficients, phi):
    return State([coefficients], solver.shared(phi, np.zeros(0)))


@pytest.mark.parametrize("better", [True, False])
def test_of_two_places_to_begin_the_cheaper_one_is_taken(light_capped, trial, better):
    near, far = trial.start, replace(trial.start, q=trial.start.q + 0.5)
    begun = {"initial": far, "other_start": near} if better else {"initial": near, "other_start": far}
    alone = TrajectorySolver(light_capped, [replace(trial, initial=near)], SETTINGS).begun(None)
    chosen = TrajectorySolver(light_capped, [replace(trial, **begun)], SETTINGS).begun(None)
    np.testing.assert_array_equal(chosen.coefficients[0], alone.coefficients[0])
