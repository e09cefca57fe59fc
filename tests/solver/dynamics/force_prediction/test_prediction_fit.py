"""A wrench that repeats with the step and that no plate tells is predicted on hidden frames."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.force_prediction.prediction_columns import PredictionTrial
from solver.dynamics.force_prediction.prediction_fit import fit_prediction
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from tests.solver.dynamics.force_prediction.conftest import FEET

SETTINGS, TRAJECTORY = PredictionSettings(), TrajectorySettings()


@pytest.fixture(scope="module")
def hidden(hidden_wrench_walk):
    """Two blocks, one of them around a footfall."""
    frames = np.zeros(hidden_wrench_walk.motion.frames, dtype=bool)
    frames[90:112] = frames[200:222] = frames[290:312] = True
    return frames


@pytest.fixture(scope="module")
def fitted(hidden_wrench_walk, hidden):
    """What the prediction fit begins with, and what the fit itself predicts."""
    return fitted_without(hidden_wrench_walk, hidden, noise_m=0.001)


def fitted_without(walk, hidden, noise_m):
    data = walk.data(noise_m=noise_m)
    data = replace(data, counts=data.counts & ~hidden)
    plain = fit_trajectories(walk.skeleton, [data], TRAJECTORY)
    trial = PredictionTrial(replace(data, initial=plain.motions[0]), FEET, walk.in_contact)
    return trial, plain.phi, required_ground(plain.skeleton, plain.motions[0])


def missed(walk, told_ground, hidden):
    """RMS force on hidden frames [N]."""
    off = (told_ground - walk.wrench_ground + walk.hidden_ground)[hidden, :3]
    return float(np.sqrt((off**2).sum(axis=1).mean()))


def test_a_repeating_wrench_is_predicted_on_hidden_blocks(hidden_wrench_walk, hidden, fitted):
    walk, (trial, phi, plain) = hidden_wrench_walk, fitted
    learnt = fit_prediction(walk.skeleton, [trial], TRAJECTORY, SETTINGS, phi=phi)
    assert "steps" in learnt.kinds
    assert missed(walk, learnt.wrenches_ground[0], hidden) < 0.6 * missed(walk, plain, hidden)


def test_what_plates_tell_on_hidden_frames_has_no_say(hidden_wrench_walk, hidden, fitted):
    trial, phi, _ = fitted
    data = replace(trial.data, wrench_ground=np.where(hidden[:, None], 1e3, trial.data.wrench_ground))
    contact = np.where(hidden[:, None], ~trial.in_contact, trial.in_contact)
    other = PredictionTrial(data, FEET, contact)
    one, two = (
        fit_prediction(hidden_wrench_walk.skeleton, [t], TRAJECTORY, SETTINGS, phi=phi)
        for t in (trial, other)
    )
    assert one.kinds == two.kinds
    np.testing.assert_allclose(two.wrenches_ground[0], one.wrenches_ground[0], atol=1e-6)


def test_exact_forces_are_not_predicted_worse(hidden_wrench_walk, hidden):
    walk = replace(hidden_wrench_walk, hidden_ground=np.zeros_like(hidden_wrench_walk.hidden_ground))
    trial, phi, plain = fitted_without(walk, hidden, noise_m=0.0002)
    learnt = fit_prediction(walk.skeleton, [trial], TRAJECTORY, SETTINGS, phi=phi)
    assert missed(walk, learnt.wrenches_ground[0], hidden) < 1.05 * missed(walk, plain, hidden)


def test_without_any_kind_it_is_a_smoother_fit(hidden_wrench_walk, hidden, fitted):
    trial, phi, _ = fitted
    learnt = fit_prediction(hidden_wrench_walk.skeleton, [trial], TRAJECTORY, SETTINGS, phi=phi, kinds=())
    assert learnt.kinds == ()
    assert learnt.notes == ()
    assert missed(hidden_wrench_walk, learnt.wrenches_ground[0], hidden) > 0
