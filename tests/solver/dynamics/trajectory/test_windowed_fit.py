"""Two trials that are long together: inertias and x are those of all frames, whichever taught them first."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.trajectory.frame_spans import teaching_spans
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions

RATE, FRAMES = 50.0, 45
WHOLE = TrajectorySettings(knot_spacing_s=0.04, tolerance=1e-6)
IN_PARTS = replace(WHOLE, whole_frames=60, inertia_frames=FRAMES, stretch_frames=FRAMES, window_frames=FRAMES)
PRIOR = ExtraParameters(prior_std=np.array([50.0, 30.0]), start=np.zeros(2))
TRUE_X = np.array([20.0, -15.0])


@pytest.fixture(scope="module")
def trials(crane, crane_q):
    """Of a body with a heavier segment. A push along x acts in both, one along z in the second alone."""
    rng, made = np.random.default_rng(2), []
    segment = replace(crane.bodies[2], mass=1.15 * crane.bodies[2].mass)
    true = replace(crane, bodies=(*crane.bodies[:2], segment, *crane.bodies[3:]))
    for k in range(2):
        motion = Motion(crane.dofs, crane_q[k * FRAMES : (k + 1) * FRAMES], RATE)
        exact = marker_positions(crane, motion.q)
        observed = exact + rng.normal(0, 0.001, exact.shape)
        columns = np.zeros((FRAMES, 6, 2))
        columns[:, 0, 0] = 1 + np.sin(9 * motion.times)
        columns[10:30, 2, 1] = k
        counts = np.ones(FRAMES, dtype=bool)
        counts[: 5 * k] = False  # the first one teaches
        recorded = required_ground(true, motion) - columns @ TRUE_X
        made.append(TrialData(observed, recorded, counts, motion, extra_columns_ground=columns))
    return made


def test_inertias_and_x_are_those_of_all_frames(crane, trials):
    whole, parts = (fit_trajectories(crane, trials, s, extra=PRIOR) for s in (WHOLE, IN_PARTS))
    std = np.sqrt(np.diag(whole.extra_covariance))
    assert np.all(np.abs(whole.extra - TRUE_X) < 3 * std)
    assert np.all(np.abs(parts.extra - whole.extra) < 0.05 * std)
    np.testing.assert_allclose(parts.extra_covariance, whole.extra_covariance, rtol=0.05, atol=1e-3)
    apart = np.abs(parts.phi - whole.phi).max()
    one = fit_trajectories(crane, trials[:1], WHOLE, extra=PRIOR)
    assert apart < 0.05 * np.abs(one.phi - whole.phi).max()
    for a, b in zip(parts.motions, whole.motions, strict=True):
        np.testing.assert_allclose(a.q, b.q, atol=1e-4)


def test_what_the_first_trial_lacks_the_second_teaches(trials):
    plain = [replace(trial, extra_columns_ground=None) for trial in trials]
    assert {span.trial for span in teaching_spans(plain, [2, 2], IN_PARTS)} == {0}
    assert {span.trial for span in teaching_spans(trials, [2, 2], IN_PARTS)} == {0, 1}
