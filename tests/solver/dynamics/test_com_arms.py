"""Oracle, ours and piecewise: what each may see, and that only the last one tears."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.true_runs import runs
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import MassPrior, com_data
from solver.dynamics.cross_validation.force_ablation import ARMS, oracle, ours, piecewise
from solver.skeleton.pinocchio_model import RigidBodyModel
from tests.conftest import MARKERS_ALONE

SETTINGS = ComSettings()
FRAMES = 500


@pytest.fixture
def noisy(walker):
    data = walker(FRAMES)
    noise = 0.004 * np.random.default_rng(3).normal(size=data.com_ground.shape)
    return replace(data, com_ground=data.com_ground + noise)


@pytest.fixture
def hidden(unseen_steps):
    return unseen_steps(FRAMES, 100.0)


def test_the_oracle_sees_what_is_hidden_and_the_others_do_not(noisy, hidden):
    other = replace(noisy, force_ground=np.where(hidden[:, None], 1.1, 1.0) * noisy.force_ground)
    changes = {
        name: np.abs(arm(noisy, hidden, SETTINGS).com_ground - arm(other, hidden, SETTINGS).com_ground).max()
        for name, arm in ARMS.items()
    }
    assert changes["oracle"] > 1e-4
    assert changes["ours"] == changes["piecewise"] == 0.0


def test_with_nothing_hidden_all_arms_are_one(noisy):
    nothing = np.zeros(FRAMES, dtype=bool)
    expected = oracle(noisy, nothing, SETTINGS).com_ground
    np.testing.assert_array_equal(ours(noisy, nothing, SETTINGS).com_ground, expected)
    np.testing.assert_array_equal(piecewise(noisy, nothing, SETTINGS).com_ground, expected)


def test_the_runs_of_piecewise_know_nothing_of_each_other(noisy, hidden):
    (start, end), *others = runs(~hidden)
    force = noisy.force_ground.copy()
    force[start:end, 0] += 50.0
    before, after = (piecewise(d, hidden, SETTINGS) for d in (noisy, replace(noisy, force_ground=force)))
    assert np.abs(after.com_ground - before.com_ground)[start:end].max() > 1e-5
    for other in others:
        np.testing.assert_array_equal(after.com_ground[slice(*other)], before.com_ground[slice(*other)])


def test_between_its_runs_piecewise_leaves_the_markers_and_the_input_alone(noisy, hidden):
    kept = noisy.com_ground.copy()
    found = piecewise(noisy, hidden, SETTINGS)
    np.testing.assert_array_equal(found.com_ground[hidden], kept[hidden])
    np.testing.assert_array_equal(noisy.com_ground, kept)


def test_a_run_of_two_frames_stays_as_measured(noisy):
    hidden = np.ones(FRAMES, dtype=bool)
    hidden[100:102] = False
    found = piecewise(noisy, hidden, SETTINGS)
    np.testing.assert_array_equal(found.com_ground, noisy.com_ground)
    assert found.inverse_mass == 0.0


def test_piecewise_tears_at_the_borders_and_ours_does_not(noisy, hidden):
    borders = np.flatnonzero(np.diff(hidden))
    jolt = {
        name: np.abs(np.diff(arm(noisy, hidden, SETTINGS).com_ground, 2, axis=0)[borders - 1]).max() * 100**2
        for name, arm in ARMS.items()
    }
    assert jolt["ours"] < 10.0 < jolt["piecewise"]  # [m/s²]; the walk itself stays below 3


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_a_fixed_mass_holds_in_every_arm(noisy, hidden, arm):
    found = arm(noisy, hidden, SETTINGS, MassPrior(77.0, 0.0))
    assert found.inverse_mass == pytest.approx(1 / 77.0)


@pytest.mark.slow
@pytest.mark.real
def test_hidden_steps_of_a_real_treadmill_walk(recorded_fit):
    """Every third right step: the force that the trajectory demands there against the hidden measurement.

    It has to beat the markers alone, filtered as the forces are, and the paper's form, which trusts the
    forces on the other frames without limit.
    """
    fit = recorded_fit("walk_treadmill_stepwidth", MARKERS_ALONE)
    trial = fit.trials[0]
    data = com_data(fit.skeleton, trial.motion, trial.contacts, trial.mask)
    right = trial.contacts.foot_bodies.index("calcn_r")
    hidden = np.zeros(data.frames, dtype=bool)
    for start, end in runs(trial.contacts.in_contact[:, right])[::3]:
        hidden[start:end] = True
    judged = hidden.copy()
    judged[:10] = judged[-10:] = False

    filtered = trial.dynamics.motion
    accelerations = {
        "ours": ours(data, hidden, SETTINGS).acceleration_ground,
        "paper": ours(data, hidden, replace(SETTINGS, force_error_m_s2=0.0)).acceleration_ground,
        "markers": RigidBodyModel(fit.skeleton).centre_of_mass_acceleration(
            filtered.q, filtered.velocity, filtered.acceleration
        ),
    }
    rms = {}
    for name, acceleration in accelerations.items():
        error = fit.mass_kg * (acceleration - data.gravity) - data.force_ground
        rms[name] = np.sqrt(np.mean(np.sum(error[judged] ** 2, axis=1)))
    assert rms["ours"] < 0.8 * rms["markers"]
    assert rms["ours"] < 0.8 * rms["paper"]
