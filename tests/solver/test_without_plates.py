"""Real recordings with their forces taken away: torques come out all the same, told to be predicted."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common.typed_json import plain
from solver.contact.mask import NOT_RECORDED, OUTSIDE_RANGES
from solver.export.b3d.from_fit import fit_to_b3d, reason_number
from solver.export.opensim import export_opensim
from solver.export.trial_table import trial_columns
from solver.fitting.pipeline import solve
from solver.fitting.summary import all_notes, summary
from solver.fitting.torques_stage import under_forces
from tests.conftest import NO_HELD_OUT as SETTINGS

pytestmark = [pytest.mark.real, pytest.mark.slow]  # their fixtures take long

ENDS = slice(15, -15)
FULL_BODY_WALK = "walk_rajagopal2015"
WITHOUT_ARMS = "walk_gait2354_subject01"
RUN = "run_treadmill_hamner2013_subject04"


def without_forces(subject, trials=None):
    kept = [replace(t, forces=None, reviews=()) for t in subject.trials if trials is None or t.name in trials]
    return replace(subject, trials=tuple(kept))


@pytest.fixture(scope="module")
def pair(real_data, recorded_fit):
    """By folder: the fit of a recording's only trial without its forces, and with them."""
    kept = {}

    def made(folder):
        if folder not in kept:
            subject = open_subject(real_data / folder)
            names = [subject.trials[0].name]
            bare = solve(without_forces(subject, names), SETTINGS)
            kept[folder] = bare, recorded_fit(folder, SETTINGS)
        return kept[folder]

    return made


def recorded_total(fit):
    trial = fit.trials[0]
    used = trial.dynamics.used.copy()
    return trial.contacts.wrench_ground[:, :, :3].sum(axis=1), used


@pytest.mark.parametrize(("folder", "at_most"), [(FULL_BODY_WALK, 0.45), (WITHOUT_ARMS, 0.5), (RUN, 1.7)])
def test_the_total_force_is_near_the_recorded_one(pair, folder, at_most):
    """At most: N/kg, RMS; at 6 Hz the markers miss 0.44, 0.35 and 1.9."""
    bare, measured = pair(folder)
    recorded, used = recorded_total(measured)
    used[:15] = used[-15:] = False
    predicted = bare.trials[0].dynamics.wrench_predicted_ground[:, :, :3].sum(axis=1)
    missed = np.sqrt(((predicted - recorded)[used] ** 2).sum(axis=1).mean()) / bare.mass_kg
    assert missed < at_most


def test_torques_are_finite_and_nearer_to_those_with_forces_than_without_any(pair):
    """The knee's least: a few centimetres of the centre of pressure are as much as its torque."""
    bare, measured = pair(FULL_BODY_WALK)
    ours, theirs = bare.trials[0].dynamics, measured.trials[0].dynamics
    swinging = under_forces(
        bare.trials[0], ours.motion, bare.skeleton, SETTINGS
    )  # as if the ground did nothing
    assert np.isfinite(ours.joint_torques).all()
    used = theirs.used.copy()
    used[:15] = used[-15:] = False
    for name, share in (
        ("ankle_angle_r", 0.5),
        ("hip_adduction_r", 0.5),
        ("hip_flexion_r", 0.75),
        ("knee_angle_r", 1.0),
    ):
        dof = bare.skeleton.dofs.index(name)
        apart = (ours.joint_torques - theirs.joint_torques)[used, dof]
        unloaded = (swinging.joint_torques - theirs.joint_torques)[used, dof]
        assert np.sqrt((apart**2).mean()) < share * np.sqrt((unloaded**2).mean()), name


def test_everything_is_marked_as_predicted_and_no_residual_is_claimed(pair):
    bare, _ = pair(FULL_BODY_WALK)
    (trial,) = bare.trials
    assert trial.forces_predicted
    assert trial.dynamics.wrench_is_predicted.all()
    assert not trial.dynamics.used.any()
    assert not trial.mask.counts.any()
    assert (0, trial.motion.frames, None, NOT_RECORDED) in trial.mask.reasons
    (figures,) = plain(summary(bare))["trials"]
    assert figures["forces_predicted"]
    assert figures["torques_predicted_ranges"] == [[0, trial.motion.frames]]
    assert figures["linear_residual"] is None
    assert (
        figures["hicks"]["linear"] is figures["hicks"]["angular"] is figures["hicks"]["angular_paper"] is None
    )
    assert any("predicted from the motion" in note for note in all_notes(bare))


def test_exports_say_what_was_never_measured(pair, tmp_path):
    bare, _ = pair(FULL_BODY_WALK)
    (trial,) = bare.trials
    header = fit_to_b3d(bare).header.trial_header[0]
    outside_ranges = reason_number(OUTSIDE_RANGES)
    assert set(np.asarray(header.missing_GRF_reason)) == {reason_number(NOT_RECORDED), outside_ranges}
    assert header.processing_pass_header[1].lowpass_cutoff_frequency == SETTINGS.dynamics.unmeasured_cutoff_Hz
    columns = trial_columns(trial, bare.skeleton)
    assert columns["calcn_r_predicted"].all()
    assert not columns["used"].any()
    assert not columns["calcn_r_force_y_N"].any()
    assert columns["calcn_r_predicted_force_y_N"].max() > 0.8 * bare.mass_kg * 9.81
    files = {path.name: path for path in export_opensim(bare, tmp_path)}
    assert "walk_grf.mot" not in files
    assert "predicted" in files["walk_grf_predicted.mot"].read_text().splitlines()[0]
    assert "walk_grf_predicted.mot" in files["walk_external_loads.xml"].read_text()
    assert f"frames 0-{trial.motion.frames - 1}" in files["walk_id.sto"].read_text().splitlines()[0]


def test_torques_rest_on_the_predicted_forces(pair):
    """Put in as if they had been measured, they give the same torques."""
    bare, _ = pair(FULL_BODY_WALK)
    (trial,) = bare.trials
    wrench = trial.dynamics.wrench_predicted_ground
    as_measured = replace(
        trial,
        contacts=replace(trial.contacts, wrench_ground=wrench, wrench_raw_ground=wrench),
        mask=replace(trial.mask, counts=np.ones_like(trial.mask.counts)),
    )
    again = under_forces(as_measured, trial.dynamics.motion, bare.skeleton, SETTINGS)
    np.testing.assert_allclose(again.joint_torques, trial.dynamics.joint_torques, atol=1e-6)


def test_nothing_touches_the_ground_in_flight(pair):
    bare, measured = pair(RUN)
    recorded, used = recorded_total(measured)
    predicted = bare.trials[0].dynamics.wrench_predicted_ground
    flies = used & (recorded[:, 1] < 20.0)
    assert flies.sum() > 20
    assert (predicted[flies] == 0).all(axis=(1, 2)).mean() > 0.5


def test_unseen_arms_are_told_and_seen_ones_are_not(pair):
    assert any("no marker shows how" in note for note in pair(WITHOUT_ARMS)[0].trials[0].notes) == (
        "humerus_r" in pair(WITHOUT_ARMS)[0].skeleton.body_names
    )
    assert not any("no marker shows how" in note for note in pair(FULL_BODY_WALK)[0].trials[0].notes)


def test_the_mass_that_other_trials_forces_tell_is_used(real_data):
    subject = open_subject(real_data / "opencap_subject4")
    kept = [t for t in subject.trials if t.name in ("walking1", "squats1")]
    assert len(kept) == 2
    mixed = replace(
        subject,
        mass_kg=None,
        trials=tuple(replace(t, forces=None) if t.name == "squats1" else t for t in kept),
    )
    fit = solve(mixed, SETTINGS)
    predicted = next(t for t in fit.trials if t.capture.name == "squats1")
    assert predicted.forces_predicted
    up = predicted.dynamics.wrench_predicted_ground[ENDS, :, 1].sum(axis=1)
    assert abs(up.mean() / 9.80665 - fit.mass_kg) < 1.0
    assert abs(fit.mass_kg - 63.6) < 1.5  # what the walk's plates carry
