"""A fit as a subject: who, which trials, which passes, and what the headers say of them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from annotations import reasons as spoken
from solver.capture.capture import Subject
from solver.capture.formats.b3d.b3d_fields import REASONS
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.common.errors import ModelError
from solver.common.notes import Kind, noted
from solver.contact import mask as contact_mask
from solver.contact.wrenches import DETECTION, PERSON, RECORDING, SOURCES, FrameMask
from solver.export.b3d.from_fit import NEAREST, export_b3d, fit_to_b3d, reason_number, reasons_per_frame
from solver.export.b3d.pass_frames import dofs_in_order
from solver.fitting.fit_result import KinematicsOnly
from solver.fitting.settings import Settings, as_dict
from solver.kinematics.marker_errors import MarkerErrors
from solver.skeleton.osim import load_skeleton
from tests.made_std import made_std


@pytest.fixture
def standing_still(fit):
    """A second trial: fewer frames, no forces."""
    walk = fit.trials[0]
    short = replace(walk.motion, q=walk.motion.q[:20])
    markers = replace(walk.capture.markers, names=("M1",), positions_ground=np.ones((20, 1, 3)))
    return replace(
        walk,
        capture=replace(walk.capture, name="standing", markers=markers),
        motion=short,
        marker_errors=MarkerErrors(("M0",), np.zeros((20, 1))),
        contacts=None,
        mask=None,
        dynamics=None,
    )


def pass_header(fit, trial=0, which=-1):
    return fit_to_b3d(fit).trials[trial].header.processing_pass_header[which]


def with_trial(fit, **changes):
    return replace(fit, trials=(replace(fit.trials[0], **changes),))


def test_who(fit):
    subject = replace(
        fit.subject,
        sex="female",
        age_years=30.6,
        tags=("healthy",),
        notes=noted(Kind.OTHER, "height guessed"),
    )
    header = fit_to_b3d(replace(fit, subject=subject, provenance={"addb-viewer": "9.9"})).header
    assert (header.mass_kg, header.height_m, header.biological_sex, header.age_years) == (
        6.0,
        1.7,
        "female",
        31,
    )
    assert header.subject_tag == ("healthy",)
    assert header.notes.startswith("addb-viewer 9.9\nheight guessed")
    assert (header.num_dofs, header.num_joints, header.num_trials, header.version) == (13, 5, 1, 4)
    assert header.ground_contact_body == ("foot_r",)
    assert header.data_quality == 1


def test_the_model_inside_is_the_skeleton(fit, tmp_path):
    model = fit_to_b3d(fit).header.passes[-1]
    (tmp_path / "model.osim").write_text(model.model_osim_text, encoding="utf-8")
    found = load_skeleton(tmp_path / "model.osim")
    assert found.dofs == fit.skeleton.dofs
    assert found.mass == pytest.approx(6.0)


def test_a_trial(fit):
    header = fit_to_b3d(fit).trials[0].header
    assert (header.name, header.original_name, header.trial_length) == ("walk", "walk", 90)
    assert header.trial_timestep == pytest.approx(0.02)
    assert (header.original_start_frame, header.original_end_frame) == (0, 90)
    assert (header.original_start_time, header.original_end_time) == pytest.approx((0.35, 2.15))
    assert header.missing_GRF_reason.tolist() == [0] * 90
    assert not header.has_manual_GRF_annotation.any()
    assert header.trial_type == 3


def test_standard_deviations_are_custom_values_of_each_frame(fit, standing_still, tmp_path):
    std, dofs = made_std(90, len(fit.skeleton.dofs)), list(fit.skeleton.dofs)
    std.angle[:] = np.arange(len(dofs))
    counts = np.ones((90, 1), dtype=bool)
    counts[30:40] = False
    mask = FrameMask(counts, ((30, 40, "foot_r", "notOverForcePlate"),), source="review")
    walk = replace(fit.trials[0], std=std, mask=mask)
    (path,) = export_b3d(replace(fit, trials=(walk, standing_still)), tmp_path)
    b3d = read_b3d(path)
    names, lengths = b3d.header.custom_value_name, b3d.header.custom_value_length
    assert names == ("pos_std", "vel_std", "acc_std", "tau_std", "com_pos_std")
    first, other = (
        dict(zip(names, np.split(trial.sensors.custom_values, np.cumsum(lengths)[:-1], axis=1), strict=True))
        for trial in b3d.trials
    )
    order = dofs_in_order(fit.skeleton)
    for column, name in enumerate(order):
        expected = dofs.index(name) if name in dofs else np.nan  # locked
        np.testing.assert_array_equal(first["pos_std"][:, column], expected)
    free = [name in dofs for name in order]
    np.testing.assert_array_equal(first["vel_std"][:, free], 0.02)
    np.testing.assert_array_equal(first["acc_std"][:, free], 0.03)
    unknown = np.isin(np.arange(90), [0, *range(30, 40)])
    np.testing.assert_array_equal(first["tau_std"][unknown], np.nan)
    np.testing.assert_array_equal(first["tau_std"][~unknown][:, free], 0.04)
    np.testing.assert_array_equal(first["com_pos_std"], 0.001)
    assert all(np.isnan(values).all() for values in other.values())
    assert fit_to_b3d(fit).header.custom_value_name == ()


def test_a_reviewed_trial(fit):
    counts = np.ones((90, 1), dtype=bool)
    counts[30:40] = False
    mask = FrameMask(counts, ((30, 40, "foot_r", "notOverForcePlate"),), source="review")
    trial = fit_to_b3d(with_trial(fit, mask=mask)).trials[0]
    assert trial.header.missing_GRF_reason.tolist() == [0] * 30 + [5] * 10 + [0] * 50
    assert trial.header.has_manual_GRF_annotation.all()
    frames = trial.passes[0]
    np.testing.assert_array_equal(frames.ground_contact_wrench[30:40], 0.0)
    np.testing.assert_array_equal(frames.ground_contact_center_of_pressure[30:40], 0.0)
    assert (frames.ground_contact_force[[29, 40], 1] > 200).all()


def test_residuals_are_of_the_generalized_forces_and_zero_at_the_ends(fit):
    torques = fit.trials[0].dynamics.joint_torques
    dofs = list(fit.skeleton.dofs)
    about = pass_header(fit)
    for residual, names in (
        (about.linear_residual, ("tx", "ty", "tz")),
        (about.angular_residual, ("tilt", "list", "turn")),
    ):
        own = torques[:, [dofs.index(name) for name in names]]
        np.testing.assert_allclose(residual[1:-1], np.sqrt((own**2).sum(axis=1))[1:-1], rtol=1e-6)
        assert residual[[0, -1]].tolist() == [0, 0]


def test_marker_errors_and_what_markers_see(fit):
    distance = np.tile([0.03, 0.04], (90, 1))
    distance[7], distance[8, 0] = np.nan, np.nan
    errors = MarkerErrors(("M4", "M10"), distance)  # on the thigh and on the patella
    about = pass_header(with_trial(fit, marker_errors=errors))
    assert about.marker_rms[0] == pytest.approx(np.sqrt(0.00125))
    assert about.marker_max[0] == pytest.approx(0.04)
    assert np.isnan(about.marker_rms[7])
    assert np.isnan(about.marker_max[7])
    assert about.marker_rms[8] == pytest.approx(0.04)
    assert about.dof_positions_observed.tolist() == [True] * 10 + [False] * 3  # ankle, a locked one, shoulder
    assert about.dof_velocities_finite_differenced.all()
    on_the_foot = MarkerErrors(("M11",), np.zeros((90, 1)))
    about = pass_header(with_trial(fit, marker_errors=on_the_foot))
    assert about.dof_positions_observed.tolist() == [True] * 11 + [False] * 2


def test_the_fastest_coordinate(fit):
    frames = fit_to_b3d(fit).trials[0].passes[0]
    np.testing.assert_allclose(
        pass_header(fit).joints_max_velocity, np.abs(frames.vel).max(axis=1), rtol=1e-6
    )


def test_filter_and_threshold_come_from_the_settings(fit):
    about = pass_header(replace(fit, settings=as_dict(Settings())))
    assert about.lowpass_cutoff_frequency == pytest.approx(20.0)  # 0.8 of the Nyquist frequency of 50 Hz
    assert about.lowpass_filter_order == 3
    assert pass_header(fit).lowpass_cutoff_frequency == 0.0


def test_a_fitted_trajectory_is_a_pass_of_its_own(fit):
    walk = fit.trials[0]
    before = KinematicsOnly(replace(walk.motion, q=walk.motion.q + 0.01), walk.marker_errors)
    b3d = fit_to_b3d(replace(with_trial(fit, kinematics_only=before), settings=as_dict(Settings())))
    assert [model.pass_type for model in b3d.header.passes] == [0, 2, 1]
    headers = b3d.trials[0].header.processing_pass_header
    assert [about.type for about in headers] == [0, 2, 1]
    assert [about.lowpass_cutoff_frequency for about in headers] == pytest.approx([0, 20, 0])
    assert [about.lowpass_filter_order for about in headers] == [0, 3, 0]
    first, low, last = b3d.trials[0].passes
    np.testing.assert_allclose(first.pos[:, 0] - last.pos[:, 0], 0.01)
    sos = butter(3, 20 / 25, output="sos")
    np.testing.assert_allclose(low.pos[20:-20], sosfiltfilt(sos, first.pos, axis=0)[20:-20], atol=1e-6)


def test_without_a_fit_to_forces_the_last_pass_is_the_low_passed_one(fit):
    motion = fit.trials[0].motion
    b3d = fit_to_b3d(with_trial(fit, motion=replace(motion, q=motion.q + 0.01)))
    assert [model.pass_type for model in b3d.header.passes] == [0, 2]
    raw, low = b3d.trials[0].passes
    np.testing.assert_allclose(raw.pos[:, 0] - low.pos[:, 0], 0.01)


def test_trials_with_and_without_forces_in_one_file(fit, standing_still, tmp_path):
    (path,) = export_b3d(replace(fit, trials=(*fit.trials, standing_still)), tmp_path / "results")
    assert path == tmp_path / "results" / "subject.b3d"
    walk, standing = read_b3d(path).trials
    assert standing.header.missing_GRF_reason.tolist() == [14] * 20
    np.testing.assert_array_equal(standing.passes[0].ground_contact_wrench, np.zeros((20, 6)))
    assert read_b3d(path).header.marker_name == ("M0", "M1")
    assert np.isnan(standing.sensors.marker_obs[:, :3]).all()
    assert np.isnan(walk.sensors.marker_obs[:, 3:]).all()


def test_without_any_forces_the_feet_are_the_subjects(fit, standing_still):
    subject = replace(fit.subject, foot_bodies=("foot_r", "foot_l"))
    b3d = fit_to_b3d(replace(fit, subject=subject, trials=(standing_still,)))
    assert b3d.header.ground_contact_body == ("foot_r",)


def test_a_root_that_is_not_free(small_fit):
    with pytest.raises(ModelError, match="root"):
        fit_to_b3d(small_fit)


def test_names_that_files_cannot_have(fit, tmp_path):
    subject = Subject(tmp_path / "Zoë/1:2", ())
    (path,) = export_b3d(replace(fit, subject=subject), tmp_path)
    assert path.name == "1_2.b3d"


def test_the_numbers_of_the_format():
    """A few by hand, from the format's own list."""
    numbers = {
        "notMissingGRF": 0,
        "notOverForcePlate": 5,
        "manualReview": 10,
        "hasNoForcePlateData": 14,
        "extendedToNearestPeakForce": 18,
    }
    assert {name: reason_number(name) for name in numbers} == numbers


def test_people_choose_from_the_same_list():
    assert spoken.REASONS == REASONS


def test_every_reason_of_the_mask_has_a_number():
    own = {value for name, value in vars(contact_mask).items() if name.isupper() and isinstance(value, str)}
    own -= {*SOURCES, RECORDING}  # who says so, not why
    assert own <= set(REASONS) | set(NEAREST)
    assert set(NEAREST.values()) <= set(REASONS)


def test_words_of_a_person_are_a_manual_review():
    assert reason_number("shoe came off") == 10


def test_frame_by_frame():
    counts = np.ones((8, 2), dtype=bool)
    counts[1:4, 0] = counts[3:6, 1] = counts[7] = False
    mask = FrameMask(
        counts,
        (
            (1, 4, "calcn_r", "notOverForcePlate"),
            (3, 6, "calcn_l", "copOutsideConvexFootError"),
            (4, 5, None, "manualReview"),
            (0, 1, None, "forceDiscrepancy"),  # a reason, but the force counts all the same
        ),
    )
    assert reasons_per_frame(mask, 8).tolist() == [0, 5, 5, 5, 10, 16, 0, 2]


def test_a_persons_reason_goes_before_detections_and_the_recordings_own():
    mask = FrameMask(
        np.zeros((4, 2), dtype=bool),
        (
            (0, 4, None, "hasNoForcePlateData"),
            (1, 4, "calcn_r", "forceDiscrepancy"),
            (2, 3, "calcn_l", "notOverForcePlate"),
        ),
        sources=(RECORDING, DETECTION, PERSON),
    )
    assert reasons_per_frame(mask, 4).tolist() == [14, 4, 5, 4]


def test_without_forces():
    assert reasons_per_frame(None, 3).tolist() == [14, 14, 14]
