"""What is collected from a fit before anything is written."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.trial_view.recorded_subject import MARKERS_ALONE, PREVIOUS_FIT, file_of, recording_of
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.fitting.settings import Settings, as_dict, from_dict
from solver.fitting.torques_stage import filter_as_forces
from solver.skeleton.forward import body_poses, marker_positions


def test_a_fit_is_compared_with_what_the_markers_alone_said(make_fit):
    fit = make_fit("walk")
    (record,) = recording_of(fit).trials
    alone = fit.trials[0].kinematics_only.motion
    assert record.before_name == MARKERS_ALONE
    np.testing.assert_allclose(record.before.bodies.position, body_poses(fit.skeleton, alone.q)[1])
    np.testing.assert_allclose(record.before.markers.model, marker_positions(fit.skeleton, alone.q))
    before = fit.trials[0].kinematics_only.marker_errors.distance
    np.testing.assert_allclose(record.before.markers.errors, before)


def test_the_residual_before_is_that_of_the_filtered_marker_fit(make_fit):
    fit = make_fit("walk")
    trial = fit.trials[0]
    (record,) = recording_of(fit).trials
    motion = filter_as_forces(trial.kinematics_only.motion, Settings())
    told = inverse_dynamics(fit.skeleton, motion, trial.contacts, trial.mask, Settings().dynamics)
    np.testing.assert_allclose(record.before.residual.force, told.residual_root[:, :3])
    assert np.array_equal(record.before.residual.used, told.used)


def test_or_with_a_previous_fit(make_fit):
    fit = make_fit("walk")
    moved = fit.trials[0].motion
    earlier = replace(fit.trials[0], motion=replace(moved, q=moved.q + 0.3))
    (record,) = recording_of(fit, previous=replace(fit, trials=(earlier,))).trials
    assert record.before_name == PREVIOUS_FIT
    expected = body_poses(fit.skeleton, moved.q + 0.3)[1]
    np.testing.assert_allclose(record.before.bodies.position, expected)


def test_a_trial_without_forces_has_nothing_before(make_fit):
    fit = make_fit("walk")
    bare = replace(fit.trials[0], kinematics_only=None, dynamics=None, contacts=None, mask=None)
    (record,) = recording_of(replace(fit, trials=(bare,))).trials
    assert record.before is None
    assert all(record.missing)


def test_only_the_trials_that_are_wanted(make_fit):
    fit = make_fit("walk", "run", "jump")
    assert [r.replay.name for r in recording_of(fit, trials=["jump"]).trials] == ["jump"]
    assert [r.replay.name for r in recording_of(fit).trials] == ["walk", "run", "jump"]


def test_settings_come_back_as_they_were_kept(make_fit):
    changed = replace(Settings(), dynamics=replace(Settings().dynamics), com=replace(Settings().com))
    fit = replace(make_fit("walk"), settings={**as_dict(changed), "unknown": {"x": 1}})
    assert from_dict(fit.settings) == changed


@pytest.mark.parametrize(("name", "told"), [("walk 1", "walk 1"), ("no/forces", "no%2fforces"), ("ä", "ä")])
def test_names_of_trials_as_parts_of_paths(name, told):
    assert file_of(name) == told
