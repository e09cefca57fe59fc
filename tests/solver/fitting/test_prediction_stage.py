"""A real walk whose forces are partly missing: where the prediction fit goes, and where it costs nothing."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common import typed_json
from solver.dynamics.cross_validation.held_out_layouts import every_third, frames_of, steps_of
from solver.fitting import prediction_stage
from solver.fitting.pipeline import resolve, solve
from solver.fitting.settings import Settings
from solver.fitting.summary import summary
from tests.conftest import NO_HELD_OUT
from tests.flagged import flagged

pytestmark = pytest.mark.real

FOLDER = "walk_gait2354_subject01"
MISSING = slice(60, 85)
FAR = 20  # frames: a fifth of a second, twice as long as a marker's error is remembered
FLAG = {"walk1": flagged((MISSING.start, MISSING.stop, None, "forceDiscrepancy"))}
WITHOUT = replace(NO_HELD_OUT, prediction=replace(Settings().prediction, enabled=False))


@pytest.fixture(scope="module")
def folder(real_data):
    return real_data / FOLDER


def fitted(folder, settings, **how):
    return solve(open_subject(folder), settings, trials=["walk1"], **how)


@pytest.fixture(scope="module")
def with_and_without(folder):
    return fitted(folder, NO_HELD_OUT, reviews=FLAG), fitted(folder, WITHOUT, reviews=FLAG)


def test_what_is_predicted_changes_frames_around_the_missing_force_alone(with_and_without):
    (ours,), (plain,) = (fit.trials for fit in with_and_without)
    torques = np.abs(ours.dynamics.joint_torques - plain.dynamics.joint_torques)
    angles = np.abs(ours.motion.q - plain.motion.q)[:, 6:]
    far = np.ones(len(angles), dtype=bool)
    far[MISSING.start - FAR : MISSING.stop + FAR] = False
    assert torques[MISSING].max() > 1.0
    assert rms(torques[far]) < 0.1 * rms(torques[MISSING])
    assert rms(angles[far]) < np.radians(0.1)  # two fits end within their tolerance


def rms(values):
    return np.sqrt((values**2).mean())


@pytest.mark.slow
def test_torques_of_hidden_steps_are_nearer_to_those_under_all_forces(recorded_fit):
    """Each foot's steps are hidden in turn; the recorded forces are looked at here alone."""
    bases = [recorded_fit(FOLDER, settings) for settings in (NO_HELD_OUT, WITHOUT)]
    (known,) = bases[1].trials
    legs = [k for k, dof in enumerate(known.motion.dofs) if dof.startswith(("hip", "knee", "ankle"))]
    off: list[list[np.ndarray]] = [[], []]
    for foot, body in enumerate(known.contacts.foot_bodies):
        for hidden in every_third(steps_of(known.contacts.in_contact[:, foot], known.motion.rate), 3):
            review = flagged(*((start, end, body, "missing") for start, end in hidden))
            at = frames_of(hidden, known.motion.frames) & known.dynamics.used
            for told, base, settings in zip(off, bases, (NO_HELD_OUT, WITHOUT), strict=True):
                (trial,) = resolve(base, {"walk1": review}, settings).trials
                torques = trial.dynamics.joint_torques - known.dynamics.joint_torques
                told.append(torques[at][:, legs].ravel())
    ours, plain = (np.sqrt(np.mean(np.concatenate(told) ** 2)) for told in off)
    assert ours < 0.85 * plain


def test_nothing_is_spent_where_no_force_is_missing(folder, monkeypatch):
    def fail(*_args, **_kwargs):
        pytest.fail("a prediction fit where it has nothing to tell")

    monkeypatch.setattr(prediction_stage, "fit_prediction", fail)
    assert fitted(folder, NO_HELD_OUT).trials[0].dynamics.used.any()


def test_held_out_blocks_are_judged_by_the_prediction_with_the_motion_beside_it(folder):
    fit = fitted(folder, Settings())
    (trial,) = fit.trials
    assert "steps" in trial.held_out.learnt
    figures = typed_json.plain(summary(fit))["trials"][0]["held_out"]
    assert figures["linear_residual"]["rms_N"] < figures["motion_only_linear_residual"]["rms_N"]
    plain = fitted(folder, replace(Settings(), prediction=WITHOUT.prediction)).trials[0].held_out
    assert plain.motion_only_root is None
    np.testing.assert_allclose(plain.residual_root, trial.held_out.motion_only_root, atol=1e-9)
