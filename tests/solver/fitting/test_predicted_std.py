"""Bands of predicted forces against forces that were measured, then flagged, and never seen by the fit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t

from solver.common.progress import silent
from solver.common.true_runs import runs
from solver.dynamics.cross_validation.held_out import HeldOutBlocks, HeldOutLayout
from solver.dynamics.trajectory.uncertainty import dofs_above
from solver.fitting.held_out_stage import predict_held_out
from solver.fitting.pipeline import resolve
from solver.fitting.predicted_std import with_predicted_std, wrench_errors
from solver.fitting.settings import Settings
from tests.flagged import flagged

ROOT_DOFS = 6


def layout(kind, errors):
    """Of one trial, whose held-out blocks missed these [blocks, frames, 6]."""
    count, frames = errors.shape[:2]
    ranges = np.arange(count)[:, None] * frames + [0, frames]
    squares = np.zeros((count, 2))
    products = np.einsum("bfi,bfj->bij", errors, errors)
    blocks = HeldOutBlocks(ranges, np.full(count, frames), squares, squares, (6.0, 6.0), products)
    return HeldOutLayout(kind, 0, {"walk": blocks})


@pytest.mark.parametrize("steps", [1, 3, 40])
def test_errors_of_held_out_steps_are_those_of_predictions_wider_for_few_steps(steps):
    rng = np.random.default_rng(steps)
    size = np.array([10.0, 20.0, 5.0, 4.0, 1.0, 8.0])
    errors = size * rng.normal(size=(steps, 400, 6))
    found = wrench_errors([layout("steps", errors), layout("blocks", 9 * errors)], "walk")
    missed = np.mean(errors**2, axis=(0, 1))
    np.testing.assert_allclose(np.diagonal(found), missed * (t.ppf(0.975, 2 * steps) / 1.96) ** 2, rtol=1e-3)
    np.testing.assert_allclose(found, found.T)


def test_without_held_out_steps_nothing_is_told():
    errors = np.ones((2, 10, 6))
    older = layout("steps", errors)
    older = replace(older, trials={"walk": replace(older.trials["walk"], products=None)})
    assert wrench_errors([layout("blocks", errors), older], "walk") is None
    assert wrench_errors([layout("steps", errors)], "run") is None


@pytest.fixture(scope="module")
def hidden(recorded_fit):
    """A real walk of nine steps, one of which is flagged: both fits, the step's frames and its foot."""
    fit = recorded_fit("walk_treadmill_stepwidth")
    (trial,) = fit.trials
    stances = [(f, *run) for f in range(2) for run in runs(trial.contacts.in_contact[:, f])]
    foot, start, end = next(s for s in stances if s[1] > 40 and s[2] < trial.motion.frames - 40)
    without = resolve(fit, {trial.capture.name: flagged((start, end, None, "manualReview"))}, Settings())
    if without.held_out_due:
        without = predict_held_out(without, Settings(), silent, before=fit.held_out_layouts)
    return fit, without, slice(start, end), foot


@pytest.mark.slow
@pytest.mark.real
def test_a_hidden_step_lies_within_its_bands_and_changes_of_load_have_none(hidden):
    fit, without, frames, foot = hidden
    (seen,), (blind,) = fit.trials, without.trials
    off = blind.std.predicted_force_ground[frames, foot]
    told = np.isfinite(off).all(axis=1)
    assert 0.3 < told.mean() < 0.8
    assert not told[:5].any()
    assert not told[-5:].any()
    predicted = blind.dynamics.wrench_predicted_ground[frames, foot, :3]
    missed = predicted - seen.contacts.wrench_ground[frames, foot, :3]
    assert (np.abs(missed[told]) < 1.96 * off[told]).mean() > 0.85
    assert np.median(off[told]) < 2 * np.sqrt((missed[told] ** 2).mean())
    leg = np.flatnonzero(dofs_above(fit.skeleton, seen.contacts.foot_bodies[foot]))
    leg = leg[leg >= ROOT_DOFS]
    changed = (blind.dynamics.joint_torques - seen.dynamics.joint_torques)[frames][:, leg]
    torque_std = blind.std.torque[frames][:, leg]
    np.testing.assert_array_equal(np.isfinite(torque_std), np.repeat(told[:, None], len(leg), axis=1))
    assert (np.abs(changed[told]) < 1.96 * torque_std[told]).mean() > 0.85
    assert (torque_std[told] > blind.std.torque_by_motion[frames][:, leg][told]).all()


@pytest.mark.slow
@pytest.mark.real
def test_bands_are_the_same_when_they_are_worked_out_again(hidden):
    _, without, _, _ = hidden
    (again,), (first,) = with_predicted_std(without).trials, without.trials
    for name in ("torque", "power", "predicted_force_ground"):
        np.testing.assert_array_equal(getattr(again.std, name), getattr(first.std, name))
