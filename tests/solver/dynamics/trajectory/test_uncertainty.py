"""Bands against dense inverses, against finite differences of the dynamics, and against a known truth."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common.filters import low_pass
from solver.contact.force_review import ForceLabel, ForceReview
from solver.dynamics.inertia_parameters import inertia_parameters, prior_std
from solver.dynamics.trajectory import uncertainty
from solver.dynamics.trajectory.marker_error_levels import MARKER_ERROR_LAG_S, MarkerErrorLevels
from solver.dynamics.trajectory.trajectory_search import Border
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import TrajectorySolver, trial_levels
from solver.dynamics.trajectory.trial_data import TrialData
from solver.dynamics.trajectory.uncertainty import ErrorSizes, mass_std, torque_errors, trial_std
from solver.fitting.pipeline import resolve, solve
from solver.fitting.settings import Settings
from solver.fitting.torque_covariance import frame_errors, torque_covariance
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics, marker_positions
from solver.skeleton.pinocchio_model import RigidBodyModel

RATE = 50.0
SETTINGS = TrajectorySettings(knot_spacing_s=0.04)
NOTHING = ErrorSizes(noise=0.0, skin=0.0, landmarks_m=0.0, tables=0.0)


def near_its_solution(crane, crane_q, frames):
    """A trial: data, spline, and a wrench on a body."""
    rng = np.random.default_rng(3)
    motion = Motion(crane.dofs, crane_q[:frames], RATE)
    observed = marker_positions(crane, motion.q) + rng.normal(0, 0.002, (frames, len(crane.markers), 3))
    counts = np.ones(frames, dtype=bool)
    counts[15:20] = False
    data = TrialData(observed, rng.normal(0, 20, (frames, 6)), counts, motion)
    spline = TrajectorySolver(crane, [data], SETTINGS).begun(None).coefficients[0]
    return data, spline, [("foot_r", rng.normal(0, 50, (frames, 6)))]


@pytest.fixture(scope="module")
def solved(crane, crane_q):
    return near_its_solution(crane, crane_q, 60)


def states(solver, coefficients):
    basis = solver.parts[0].basis
    return [basis.evaluate(coefficients, order) for order in range(3)]


def slow_spread(of):
    """Over draws, below 20 Hz."""
    return np.sqrt(np.mean(low_pass(np.stack(of, axis=-1), RATE, 20.0) ** 2, axis=-1))


def agree(found, expected, within=0.07):
    """As well as 48 draws tell: entry by entry in the middle, each column over all frames."""
    known = np.isfinite(found).all(axis=0)
    assert known.any()
    ratio = found[:, known] / expected[:, known]
    assert abs(np.median(ratio) - 1) < within
    columns = np.sqrt((ratio**2).mean(axis=0))
    assert 0.7 < columns.min() <= columns.max() < 1.4


def dense_covariance(solver, spline):
    """Of all coefficients: the inverse of the whole matrix."""
    (system,) = solver.linearized(solver.begun(None))
    panels, (count, dofs) = system.band.panels, spline.shape
    dense = np.zeros((count, dofs, count, dofs))
    for a in range(count):
        for k in range(min(panels.shape[2], count - a)):
            dense[a, :, a + k], dense[a + k, :, a] = panels[a, :, k], panels[a, :, k].T
    return np.linalg.inv(dense.reshape(count * dofs, -1))


def test_noise_is_the_inverse_of_the_whole_matrix(crane, solved):
    data, spline, loads = solved
    std = trial_std(crane, data, spline, loads, SETTINGS, sizes=replace(NOTHING, noise=1.0))
    solver = TrajectorySolver(crane, [data], replace(SETTINGS, fit_inertias=False))
    covariance = dense_covariance(solver, spline)
    model, feet, wrench = RigidBodyModel(crane), [crane.body_index("foot_r")], loads[0][1][:, None]
    draws = np.random.default_rng(9).multivariate_normal(np.zeros(len(covariance)), covariance, 1000)
    small, here = 1e-3, states(solver, spline)
    moved = [states(solver, spline + small * draw.reshape(spline.shape)) for draw in draws]

    def spread(of):
        return slow_spread([(of(*x) - of(*here)) / small for x in moved])

    agree(std.speed, spread(lambda q, v, a: v))
    agree(std.acceleration, spread(lambda q, v, a: a))
    agree(std.torque, spread(lambda *x: model.inverse_dynamics(*x, wrench, feet)))
    agree(std.power, spread(lambda *x: x[1] * model.inverse_dynamics(*x, wrench, feet)))
    agree(std.com_ground, spread(lambda q, v, a: model.centre_of_mass(q)))
    agree(std.angle, slow_spread([(x[0] - here[0] - (x[0] - here[0]).mean(axis=0)) / small for x in moved]))


def test_errors_of_a_frame_go_together_as_the_whole_matrix_says(crane, solved):
    """Against every column of its root, by finite differences: no draws."""
    data, spline, loads = solved
    frame, small, only_noise = 30, 1e-4, replace(NOTHING, noise=1.0)
    errors = torque_errors(crane, data, spline, loads, SETTINGS, sizes=only_noise, frame=frame)
    std = trial_std(crane, data, spline, loads, SETTINGS, sizes=only_noise).torque[frame]
    known = np.isfinite(std)
    np.testing.assert_allclose((errors**2).sum(axis=1)[known], std[known] ** 2)
    solver = TrajectorySolver(crane, [data], replace(SETTINGS, fit_inertias=False))
    root = np.linalg.cholesky(dense_covariance(solver, spline))
    columns = root.reshape(len(spline), -1)
    wrench = np.tile(loads[0][1][frame], (len(root), 1, 1))
    moved = [low_pass(of, RATE, 20.0)[frame].reshape(spline.shape[1], -1).T for of in states(solver, columns)]
    model, feet = RigidBodyModel(crane), [crane.body_index("foot_r")]
    ahead, behind = (
        model.inverse_dynamics(
            *(
                here[frame] + sign * small * by
                for here, by in zip(states(solver, spline), moved, strict=True)
            ),
            wrench,
            feet,
        )
        for sign in (1, -1)
    )
    by_columns = (ahead - behind)[:, known].T / (2 * small)
    size = np.linalg.norm(by_columns, axis=1)
    exact = by_columns @ by_columns.T / np.outer(size, size)
    found = errors[known] @ errors[known].T / np.outer(std[known], std[known])
    beside = ~np.eye(known.sum(), dtype=bool)
    assert np.abs(exact[beside]).max() > 0.7
    assert np.sqrt(np.mean((found - exact)[beside] ** 2)) < 0.2  # 48 draws tell to 0.14


def test_tables_pass_through_the_dynamics(crane, solved):
    data, spline, loads = solved
    std = trial_std(crane, data, spline, loads, SETTINGS, sizes=replace(NOTHING, tables=2.0))
    solver = TrajectorySolver(crane, [data], SETTINGS)
    moving, inertias, step = states(solver, spline), inertia_parameters(crane), 1e-5
    variance = np.zeros_like(std.torque)
    for k, size in enumerate(prior_std(inertias, SETTINGS)):
        phi = np.where(np.arange(inertias.count) == k, step, 0.0)
        ahead, behind = (
            RigidBodyModel(inertias.skeleton_at(sign * phi)).inverse_dynamics(*moving) for sign in (1, -1)
        )
        variance += ((ahead - behind) / (2 * step) * 2 * size) ** 2
    known = np.isfinite(std.torque)
    np.testing.assert_allclose(std.torque[known], np.sqrt(variance)[known], rtol=1e-5)
    np.testing.assert_array_equal(std.angle[known], 0.0)


def test_markers_that_sit_elsewhere_move_the_motion_as_refitting_does(crane, solved):
    """Landmarks off by a little, drawn anew and fitted each time."""
    data, spline, loads = solved
    off_m, fixed = 1e-4, replace(SETTINGS, fit_inertias=False)
    std = trial_std(crane, data, spline, loads, SETTINGS, sizes=replace(NOTHING, landmarks_m=off_m))
    solver, rng = TrajectorySolver(crane, [data], fixed), np.random.default_rng(5)
    state = solver.begun(None)
    factor = solver.factorized(state, solver.linearized(state))
    R = np.stack([m.body for m in crane.markers])
    poses = solver.parts[0].kinematics.poses(states(solver, spline)[0]).R_ground_body[:, R]
    here, moved = solver.gradient(state), []
    for _ in range(200):
        place = np.zeros((len(crane.markers), 3))
        for body in set(R):
            own = body == R
            arm = np.stack([m.position_body for m in crane.markers])[own]
            arm = arm - arm.mean(axis=0)
            radius = max(0.05, np.sqrt((arm**2).sum(axis=1).mean()))
            place[own] = rng.normal(size=3) + np.cross(rng.normal(size=3), arm / radius)
        shifted = data.observed_ground + off_m * np.einsum("fmij,mj->fmi", poses, place)
        other = TrajectorySolver(crane, [replace(data, observed_ground=shifted)], fixed)
        there = other.gradient(state)
        step = factor.step(
            replace(there, coefficients=(there.coefficients[0] - here.coefficients[0],))
        ).coefficients[0]
        moved.append(states(solver, step)[1])
    agree(std.speed, slow_spread(moved), within=0.15)  # of few segments: six numbers of each


def test_masses_err_as_estimates_of_drawn_people_do(crane, solved):
    """People scattered about tables, data with errors that the fit overrates, estimated anew each time."""
    data, _, _ = solved
    overrated, body_std, step = 4.0, 0.01, 1e-6
    solver = TrajectorySolver(crane, [data], SETTINGS, caution=overrated)
    state, inertias = solver.begun(None), solver.inertias
    border = solver.factorized(state, solver.linearized(state)).corner
    told = mass_std(Border(border, state.shared, solver.shared_priors), body_std, SETTINGS)
    count, nominal = inertias.count, np.array([body.mass for body in crane.bodies])
    slopes = [
        ([body.mass for body in inertias.skeleton_at(step * unit).bodies] - nominal) / step
        for unit in np.eye(count)
    ]
    by_phi = np.column_stack(slopes)
    tables = prior_std(inertias, SETTINGS)
    people = np.where(np.arange(count) % 10 == 9, 0.03, tables)  # half of a mass' 6 %
    of_body = by_phi.sum(axis=0) / (SETTINGS.body_mass_std * crane.mass)
    of_tables = np.diag(np.sqrt(overrated) / tables)
    sizes, directions = np.linalg.eigh(border - of_tables.T @ of_tables - np.outer(of_body, of_body))
    assert sizes.min() > -1e-9 * sizes.max()
    of_data = np.sqrt(np.maximum(sizes, 0.0))[:, None] * directions.T
    rng = np.random.default_rng(8)
    person = rng.normal(0, people[:, None], (count, 4000))
    seen = of_data @ person + np.sqrt(overrated) * rng.normal(size=person.shape)
    rows = np.vstack([of_data, of_tables, of_body])
    wanted = np.vstack([seen, np.zeros_like(person), of_body @ person])
    off = by_phi @ (np.linalg.lstsq(rows, wanted, rcond=None)[0] - person)
    free = inertias.group >= 0
    expected = np.hypot(off.std(axis=1), body_std * nominal)
    np.testing.assert_allclose(told.segments_kg[free], expected[free], rtol=0.05)
    assert told.body_kg == pytest.approx(np.hypot(off.sum(axis=0).std(), body_std * crane.mass), rel=0.05)
    assert (told.segments_kg[free] < told.untold_kg[free]).all()


def test_errors_of_a_video_wander_with_the_size_and_correlation_of_the_trial(crane, solved):
    """Such errors, drawn another way and fitted each time."""
    data, spline, loads = solved
    size, lasts, fixed = 0.003, 0.09, replace(SETTINGS, fit_inertias=False)
    rho = np.exp(-((np.array([1, 2]) * MARKER_ERROR_LAG_S / lasts) ** 2) / 2)
    growth = size * np.sqrt((3 - 4 * rho[0] + rho[1]) / MARKER_ERROR_LAG_S)
    markers = len(crane.markers)
    levels = MarkerErrorLevels(np.full(markers, size), np.full(markers, growth))
    assert levels.lasts_s == pytest.approx(lasts, rel=0.03)
    usual = trial_levels(ForwardKinematics(crane), data.observed_ground, data.start, fixed)
    data = replace(data, by_video=True, levels=replace(usual, marker_errors=levels))
    std = trial_std(crane, data, spline, loads, SETTINGS, sizes=replace(NOTHING, skin=1.0))
    solver, rng = TrajectorySolver(crane, [data], fixed), np.random.default_rng(5)
    state, apart = solver.begun(None), np.subtract.outer(np.arange(60), np.arange(60)) / RATE
    factor, here = solver.factorized(state, solver.linearized(state)), solver.gradient(state)
    root = np.linalg.cholesky(np.exp(-((apart / lasts) ** 2) / 2) + 1e-9 * np.eye(60))
    bodies, small, moved = np.stack([m.body for m in crane.markers]), 0.01, []
    R = solver.parts[0].kinematics.poses(states(solver, spline)[0]).R_ground_body[:, bodies]
    for _ in range(200):
        off = np.einsum("fg,gmi->fmi", root, rng.normal(size=(60, markers, 3))) + rng.normal(
            size=(markers, 3)
        )
        shifted = data.observed_ground + small * size * np.einsum("fmij,fmj->fmi", R, off)
        there = TrajectorySolver(crane, [replace(data, observed_ground=shifted)], fixed).gradient(state)
        change = (there.coefficients[0] - here.coefficients[0]) / small
        moved.append(states(solver, factor.step(replace(there, coefficients=(change,))).coefficients[0])[1])
    agree(std.speed, slow_spread(moved), within=0.1)


def test_windows_agree_with_the_whole(crane, crane_q, monkeypatch):
    data, spline, loads = near_its_solution(crane, crane_q, 90)
    sizes = replace(NOTHING, noise=1.0, tables=1.0)
    whole = trial_std(crane, data, spline, loads, SETTINGS, sizes=sizes)
    monkeypatch.setattr(uncertainty, "WINDOW_FRAMES", 70)
    monkeypatch.setattr(uncertainty, "OVERLAP_FRAMES", 35)
    parts = trial_std(crane, data, spline, loads, SETTINGS, sizes=sizes)
    agree(parts.speed, whole.speed)
    agree(parts.torque, whole.torque)


FLAGGED = {"walk": ForceReview(by_people=(ForceLabel(90, 130, "calcn_r", "manualReview"),))}


@pytest.fixture(scope="module")
def flagged_walk(walking_woman):
    return solve(open_subject(walking_woman), Settings(), reviews=FLAGGED)


def test_a_leg_whose_force_is_predicted_has_a_wider_band_and_the_other_has_its_own(flagged_walk):
    fit = flagged_walk
    (trial,) = fit.trials
    right, left = (fit.skeleton.dofs.index(f"knee_angle_{side}") for side in "rl")
    assert trial.contacts.foot_bodies == ("calcn_r", "calcn_l")
    assert not trial.mask.counts[90:130, 0].any()
    std, counts = trial.std, trial.mask.counts
    np.testing.assert_array_equal(std.torque[counts[:, 0], right], std.torque_by_motion[counts[:, 0], right])
    np.testing.assert_array_equal(std.torque[counts[:, 1], left], std.torque_by_motion[counts[:, 1], left])
    only_right = ~counts[:, 0] & counts[:, 1]
    assert (std.torque[only_right, right] > std.torque_by_motion[only_right, right]).all()
    assert np.isfinite(std.angle[:, [right, left]]).all()


def test_a_solve_without_an_edit_keeps_the_bands_and_another_foot_s_flag_makes_them_anew(flagged_walk):
    before = flagged_walk.trials[0].std
    again = resolve(flagged_walk, FLAGGED, Settings())
    assert again.mass_std.body_kg == flagged_walk.mass_std.body_kg > 0.005 * again.mass_kg
    same = again.trials[0]
    np.testing.assert_array_equal(same.std.torque, before.torque)
    assert same.std.torque_by_motion is before.torque_by_motion
    both = {"walk": ForceReview(by_people=(ForceLabel(90, 130, None, "manualReview"),))}
    other = resolve(flagged_walk, both, Settings()).trials[0]
    left_knee = flagged_walk.skeleton.dofs.index("knee_angle_l")
    assert np.isfinite(before.torque[90:130, left_knee]).all()
    wider = other.std.torque[90:130, left_knee] > 2 * before.torque[90:130, left_knee]
    assert (wider | np.isnan(other.std.torque[90:130, left_knee])).all()


@pytest.mark.parametrize("frame", [60, 110])
def test_the_covariance_of_a_frame_has_the_bands_on_its_diagonal(flagged_walk, frame):
    """On a frame with known forces, and on one that rests on a predicted wrench."""
    (trial,), settings = flagged_walk.trials, Settings()
    std = trial.std.torque[frame]
    known = np.isfinite(std)
    assert known.any()
    covariance = torque_covariance(flagged_walk, trial, frame, settings)
    np.testing.assert_allclose(np.diag(covariance)[known], std[known] ** 2)
    assert np.isnan(covariance[~known]).all()
    assert np.isnan(covariance[:, ~known]).all()
    sizes = np.linalg.eigvalsh(covariance[np.ix_(known, known)])
    assert sizes.min() > -1e-9 * sizes.max()
    errors = frame_errors(flagged_walk, trial, frame, settings)
    np.testing.assert_allclose(np.linalg.norm(errors[known], axis=1), std[known], rtol=0.01)
