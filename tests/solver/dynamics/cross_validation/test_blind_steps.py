"""Blind steps against the fit itself, blind to the same frames, and the motion that its step leads to."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.cross_validation.blind_steps import Blind, BlindSteps
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.trajectory.trajectory_search import stepped
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
    hidden, counts = np.zeros(FRAMES, dtype=bool), np.ones(FRAMES, dtype=bool)
    hidden[22:33], counts[45:50] = True, False
    trial = TrialData(observed + rng.normal(0, 0.002, observed.shape), recorded, counts, motion)
    blind = np.where(hidden[:, None, None], 0.5, columns)
    return replace(trial, extra_columns_ground=columns), hidden, blind


def missed_by_the_fit(skeleton, trial, hidden, columns, prior):
    """Of one step without these frames: nonlinear, everything made anew."""
    blind = replace(trial, counts=trial.counts & ~hidden, extra_columns_ground=columns)
    there = stepped(skeleton, [blind], SETTINGS, 1, extra=prior)
    frames, motion = np.flatnonzero(hidden), there.motions[0]
    wrench = required_ground(there.skeleton, motion)[frames] - trial.wrench_ground[frames]
    wrench -= columns[frames] @ there.extra
    poses = ForwardKinematics(there.skeleton).poses(motion.q[frames])
    return about_point(wrench, root_centre(root_joint(there.skeleton), poses))


def test_the_first_choice_misses_what_the_fit_without_these_frames_misses(crane, case):
    trial, hidden, columns = case
    steps = BlindSteps(crane, [trial], SETTINGS, extra=PRIOR)
    ((found,),) = steps.missed([Blind(hidden, columns)], [(np.ones(2, dtype=bool), 1.0)])
    expected = missed_by_the_fit(crane, trial, hidden, columns, PRIOR)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_a_choice_without_columns_is_a_fit_whose_columns_are_held_at_zero(crane, case):
    trial, hidden, columns = case
    held = ExtraParameters(np.full(2, 1e-9), np.zeros(2))
    expected = missed_by_the_fit(crane, trial, hidden, columns, held)
    steps = BlindSteps(crane, [trial], SETTINGS, extra=PRIOR)
    choices = [(np.ones(2, dtype=bool), 1.0), (np.zeros(2, dtype=bool), 1.0)]
    ((free, none),) = steps.missed([Blind(hidden, columns)], choices)
    scale = np.abs(expected).max()
    assert np.abs(free - expected).max() > 0.05 * scale
    np.testing.assert_allclose(none, expected, atol=0.02 * scale)


def test_layouts_do_not_change_each_other(crane, case):
    trial, hidden, columns = case
    steps = BlindSteps(crane, [trial], SETTINGS, extra=PRIOR)
    every = [(np.ones(2, dtype=bool), 1.0)]
    ((first,),) = steps.missed([Blind(hidden, columns)], every)
    steps.missed([Blind(trial.counts & ~hidden, trial.extra_columns_ground)], every)
    ((again,),) = steps.missed([Blind(hidden, columns)], every)
    np.testing.assert_array_equal(first, again)
