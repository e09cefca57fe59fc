"""A fitted walk on the release's grid."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.dataset.grid import Segment, cuts_of
from addb_viewer.dataset.gridded_trial import on_grid
from solver.dynamics.force_prediction.missing_wrench import torques_under
from solver.dynamics.trajectory.extension import BodyWrench, TrialExtension, with_extra_wrench
from solver.fitting.seen_part import in_whole
from solver.fitting.settings import Settings
from solver.skeleton.pinocchio_model import RigidBodyModel

SETTINGS = Settings()


@pytest.fixture(scope="module")
def halved(fit_200):
    return on_grid(fit_200, fit_200.trials[0], SETTINGS, 100.0)


def without_ringing(wrench):
    """Of a foot whose filtered force is below a thousandth of a newton nothing is left."""
    left = wrench.copy()
    for frame, foot in np.argwhere(np.hypot.reduce(wrench[..., :3], axis=2) < 1e-3):
        left[frame, foot] = 0.0
    return left


def test_at_100_hz_every_array_is_the_fits(fit_100):
    (trial,) = fit_100.trials
    got = on_grid(fit_100, trial, SETTINGS, 100.0).trial
    for own, other in (
        (got.capture.markers.positions_ground, trial.capture.markers.positions_ground),
        (got.motion.q, trial.motion.q),
        (got.motion.acceleration, trial.motion.acceleration),
        (got.kinematics_only.motion.q, trial.kinematics_only.motion.q),
        (got.kinematics_only.marker_errors.distance, trial.kinematics_only.marker_errors.distance),
        (got.marker_errors.distance, trial.marker_errors.distance),
        (got.model_markers_ground, trial.model_markers_ground),
        (got.contacts.wrench_ground, without_ringing(trial.contacts.wrench_ground)),
        (got.contacts.cop_ground, trial.contacts.cop_ground),
        (got.mask.counts, trial.mask.counts),
        (got.dynamics.joint_torques, trial.dynamics.joint_torques),
        (got.dynamics.residual_root, trial.dynamics.residual_root),
    ):
        assert np.array_equal(own, other, equal_nan=True)


def test_every_second_frame_of_200_hz_is_the_fits(fit_200, halved):
    """But for the ends, where the spline through the frames is not quite the fitted one."""
    (native,), got = fit_200.trials, halved.trial
    even = slice(None, None, 2)
    np.testing.assert_allclose(got.motion.q, native.motion.q[even], atol=1e-9)
    wrench = without_ringing(native.contacts.wrench_ground[even])
    np.testing.assert_allclose(got.contacts.wrench_ground, wrench, atol=1e-9)
    inner = slice(5, -5)
    for name in ("joint_torques", "residual_root", "residual_raw_root", "com_ground"):
        own, other = getattr(got.dynamics, name), getattr(native.dynamics, name)[even]
        np.testing.assert_allclose(own[inner], other[inner], atol=2e-3)
    assert (np.isfinite(got.contacts.cop_ground) == np.isfinite(native.contacts.cop_ground[even])).all()
    np.testing.assert_allclose(got.contacts.cop_ground, native.contacts.cop_ground[even], atol=1e-9)


def test_torques_are_those_of_the_motion_and_the_wrenches(fit_200, halved):
    trial, skeleton = halved.trial, fit_200.skeleton
    wrenches = np.where(trial.mask.counts[..., None], trial.contacts.wrench_ground, 0.0)
    wrenches += trial.dynamics.wrench_predicted_ground
    feet = [skeleton.body_index(name) for name in trial.contacts.foot_bodies]
    motion = trial.motion
    model = RigidBodyModel(skeleton)
    expected = model.inverse_dynamics(motion.q, motion.velocity, motion.acceleration, wrenches, feet)
    np.testing.assert_allclose(trial.dynamics.joint_torques, expected, atol=1e-9)
    force = skeleton.mass * (
        model.centre_of_mass_acceleration(motion.q, motion.velocity, motion.acceleration) - skeleton.gravity
    )
    counted = np.where(trial.mask.counts[..., None], trial.contacts.wrench_ground, 0.0)[..., :3].sum(axis=1)
    np.testing.assert_allclose(trial.dynamics.residual_root[:, :3], force - counted, atol=1e-6)


def test_what_counts_and_why_not(fit_200, halved):
    (native,), verdicts = fit_200.trials, halved.verdicts
    known = native.forces_known
    for k in range(halved.grid.frames):
        assert verdicts.counts[k] == known[2 * k]
        assert (verdicts.missing_reason[k] is None) == verdicts.counts[k]
        assert (verdicts.missing_number[k] == 0) == verdicts.counts[k]
    assert {word for word in verdicts.missing_reason if word} == {"footContactDetectedButNoForce"}
    assert (verdicts.detected_ok == verdicts.counts).all()
    assert not verdicts.reviewed.any()
    assert not verdicts.erroneous.any()


def test_frames_that_show_nobody_are_cut_off_and_the_others_are_as_without_them(fit_200, halved):
    (trial,), before, after = fit_200.trials, 40, 20
    markers, rows = trial.capture.markers, ((before, after), (0, 0))
    start = markers.start_time - before / markers.rate
    x = np.pad(markers.positions_ground, (*rows, (0, 0)), constant_values=np.nan)
    q = np.pad(trial.motion.q, rows, constant_values=np.nan)
    whole = replace(
        trial,
        capture=replace(trial.capture, markers=replace(markers, positions_ground=x, start_time=start)),
        motion=replace(trial.motion, q=q, start_time=start),
        left_open=None,
    )
    got = on_grid(fit_200, in_whole(trial, whole), SETTINGS, 100.0)
    frames, seen = halved.grid.frames, slice(before // 2, before // 2 + halved.grid.frames)
    assert got.verdicts.erroneous.sum() == got.grid.frames - frames
    assert not got.verdicts.erroneous[seen].any()
    assert cuts_of(got.verdicts.erroneous).kept == (Segment(seen.start, seen.stop),)
    assert np.array_equal(got.trial.dynamics.used[seen], halved.trial.dynamics.used)
    assert not got.trial.dynamics.used[: seen.start].any()
    inner = slice(5, -5)
    for own, other, within in (
        (got.trial.motion.q, halved.trial.motion.q, 1e-9),
        (got.trial.contacts.wrench_ground, halved.trial.contacts.wrench_ground, 1e-6),
        (got.trial.dynamics.residual_root, halved.trial.dynamics.residual_root, 2e-3),
        (got.trial.dynamics.joint_torques, halved.trial.dynamics.joint_torques, 2e-3),
    ):
        np.testing.assert_allclose(own[seen][inner], other[inner], atol=within)


def test_figures_use_frames_that_count_and_are_ten_native_frames_inside(fit_200, halved):
    used, native = halved.trial.dynamics.used, fit_200.trials[0].dynamics.used
    assert (used == native[::2]).all()
    assert not used[:5].any()
    assert used.any()


def test_contacts_of_the_missed_step_are_there_and_not_measured(halved):
    shares = [phase.loaded for phase in halved.phases]
    assert min(shares) == 0.0
    assert max(shares) > 0.9


def test_what_an_accepted_cause_adds_acts_on_the_grid_as_well(fit_200, halved):
    """A load on the trunk that swings: torques and residuals are those of the motion under it too."""
    (native,), skeleton = fit_200.trials, fit_200.skeleton
    frames = native.motion.frames
    seconds, none = np.arange(frames) / native.motion.rate, np.zeros((frames, 6, 0))
    swing = np.sin(2 * np.pi * 1.5 * seconds)
    load = np.column_stack([20 * swing, swing - 60, 5 + swing, 3 * swing, swing, 40 + 10 * swing])
    body = next(name for name in ("torso", "pelvis") if name in skeleton.body_names)
    everywhere = np.ones(len(load), dtype=bool)
    cause = TrialExtension((BodyWrench(body, load, none),), everywhere, everywhere)
    x = np.zeros(0)
    explained = with_extra_wrench(native.dynamics, cause, x)
    torques = torques_under(skeleton, explained, native.contacts, native.mask, acting=cause.loads(x))
    loaded = replace(native, dynamics=replace(explained, joint_torques=torques))
    got = on_grid(replace(fit_200, trials=(loaded,)), loaded, SETTINGS, 100.0)

    there, dynamics, motion = load[::2], got.trial.dynamics, got.trial.motion
    moment = there[:, 3:] - np.cross(dynamics.root_ground, there[:, :3])
    np.testing.assert_allclose(got.extra_root, np.hstack([there[:, :3], moment]), atol=1e-6)
    np.testing.assert_allclose(
        dynamics.residual_root, halved.trial.dynamics.residual_root - got.extra_root, atol=1e-9
    )
    wrenches = np.where(got.trial.mask.counts[..., None], got.trial.contacts.wrench_ground, 0.0)
    wrenches = np.concatenate([wrenches + dynamics.wrench_predicted_ground, there[:, None]], axis=1)
    bodies = [skeleton.body_index(name) for name in (*got.trial.contacts.foot_bodies, body)]
    expected = RigidBodyModel(skeleton).inverse_dynamics(
        motion.q, motion.velocity, motion.acceleration, wrenches, bodies
    )
    np.testing.assert_allclose(dynamics.joint_torques, expected, atol=1e-6)
