"""Blind steps against the fit itself, blind to the same frames, and the motion that its step leads to."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.cross_validation.held_out_steps import HeldOutSteps, TrialHeldOut
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.trajectory.trajectory_search import take_steps
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, marker_positions

FRAMES, RATE = 60, 50.0
SETTINGS = TrajectorySettings(knot_spacing_s=0.04)
PRIOR = ExtraParameters(np.array([20.0, 5.0]), np.zeros(2))


@pytest.fixture(scope="module")
def case(crane, crane_q):
    """A trial, hidden frames, and two columns as they are made without these."""
    rng = np.random.default_rng(8)
    motion = Motion(crane.dofs, crane_q[:FRAMES], RATE)
    observed = marker_positions(crane, motion.q)
    columns = np.cumsum(rng.normal(size=(FRAMES, 6, 2)), axis=0) / 5
    recorded = required_ground(crane, motion) - columns @ [15.0, -4.0] + rng.normal(0, 2, (FRAMES, 6))
    held_out, counts = np.zeros(FRAMES, dtype=bool), np.ones(FRAMES, dtype=bool)
    held_out[22:33], counts[45:50] = True, False
    trial = TrialData(observed + rng.normal(0, 0.002, observed.shape), recorded, counts, motion)
    without_held_out = np.where(held_out[:, None, None], 0.5, columns)
    return replace(trial, extra_columns_ground=columns), held_out, without_held_out


def missed_by_the_fit(skeleton, trial, held_out, columns, prior):
    """Of one step without these frames: nonlinear, everything made anew."""
    without_held_out = replace(trial, counts=trial.counts & ~held_out, extra_columns_ground=columns)
    there = take_steps(skeleton, [without_held_out], replace(SETTINGS, tolerance=1.0), 1, extra=prior)
    frames, motion = np.flatnonzero(held_out), there.motions[0]
    wrench = required_ground(there.skeleton, motion)[frames] - trial.wrench_ground[frames]
    wrench -= columns[frames] @ there.extra
    poses = ForwardKinematics(there.skeleton).poses(motion.q[frames])
    return about_point(wrench, root_centre(root_joint(there.skeleton), poses))


def test_steps_are_taken_until_one_arrives(crane, case):
    once, ours, ended = (
        take_steps(crane, [case[0]], replace(SETTINGS, tolerance=tolerance), 1, extra=PRIOR)
        for tolerance in (1.0, SETTINGS.tolerance, 1e-14)
    )
    assert once.iterations < ours.iterations < ended.iterations
    off, before = (np.abs(one.splines[0] - ended.splines[0]).max() for one in (ours, once))
    assert off < 0.1 * before


def test_the_first_choice_misses_what_the_fit_without_these_frames_misses(crane, case):
    trial, held_out, columns = case
    steps = HeldOutSteps(crane, [trial], SETTINGS, extra=PRIOR)
    ((found,),) = steps.missed([TrialHeldOut(held_out, columns)], [(np.ones(2, dtype=bool), 1.0)])
    expected = missed_by_the_fit(crane, trial, held_out, columns, PRIOR)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_a_choice_without_columns_is_a_fit_whose_columns_are_held_at_zero(crane, case):
    trial, held_out, columns = case
    held = ExtraParameters(np.full(2, 1e-9), np.zeros(2))
    expected = missed_by_the_fit(crane, trial, held_out, columns, held)
    steps = HeldOutSteps(crane, [trial], SETTINGS, extra=PRIOR)
    choices = [(np.ones(2, dtype=bool), 1.0), (np.zeros(2, dtype=bool), 1.0)]
    ((free, none),) = steps.missed([TrialHeldOut(held_out, columns)], choices)
    scale = np.abs(expected).max()
    assert np.abs(free - expected).max() > 0.05 * scale
    np.testing.assert_allclose(none, expected, atol=0.02 * scale)


def test_layouts_do_not_change_each_other(crane, case):
    trial, held_out, columns = case
    steps = HeldOutSteps(crane, [trial], SETTINGS, extra=PRIOR)
    every = [(np.ones(2, dtype=bool), 1.0)]
    ((first,),) = steps.missed([TrialHeldOut(held_out, columns)], every)
    steps.missed([TrialHeldOut(trial.counts & ~held_out, trial.extra_columns_ground)], every)
    ((again,),) = steps.missed([TrialHeldOut(held_out, columns)], every)
    np.testing.assert_array_equal(first, again)
