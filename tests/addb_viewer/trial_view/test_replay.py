from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from addb_viewer.trial_view.replay import BodySize
from addb_viewer.trial_view.replay_of_fit import fitted_replay, unfitted_replay
from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.notes import Kind, noted
from tests.demo_walk import demo_walk

PERSON = BodySize(mass_kg=100.0, height_m=2.0)


def capture(frames=10, rate=100.0, **plate):
    markers = Markers(("A", "B"), np.arange(frames * 6, dtype=float).reshape(frames, 2, 3), rate, 1.0)
    return Capture("walk", markers, (force_plate(**plate),), notes=noted(Kind.OTHER, "header says otherwise"))


def force_plate(samples=100, rate=1000.0, start=1.0):
    force = np.zeros((samples, 3))
    force[:, 1] = np.arange(samples)
    cop = np.zeros((samples, 3))
    cop[:, 0] = np.arange(samples) / 1000
    cop[:50] = np.nan
    return ForcePlate("left", force, np.zeros_like(force), cop, rate, start)


def test_forces_come_from_the_sample_nearest_in_time():
    plate = unfitted_replay(capture(start=1.003)).plates[0]
    np.testing.assert_array_equal(plate.force[1:, 1], np.arange(7, 97, 10))
    assert np.isnan(plate.force[0]).all()  # 3 ms before the first sample
    assert np.isnan(plate.cop[:5]).all()
    np.testing.assert_allclose(plate.cop[6:, 0], [0.057, 0.067, 0.077, 0.087])


@pytest.mark.slow
@pytest.mark.parametrize("level_N", [-25.0, 8.0, 30.0])
def test_loads_are_asked_for_after_the_zero_level_is_off(level_N):
    """Of a plate that nobody saw empty, so that reading left its level for conditioning."""
    walk = read_trial(open_subject(demo_walk().folder).trials[0])
    noise = np.random.default_rng(0).normal(0, 0.5, walk.plates[1].force_ground.shape)
    level = np.array([0, level_N, 0])
    moment = np.cross(np.nanmedian(walk.plates[1].cop_ground, axis=0), level)
    off = replace(
        walk.plates[1],
        force_ground=walk.plates[1].force_ground + level + noise,
        moment_ground=walk.plates[1].moment_ground + moment,
    )
    true, shown = (
        unfitted_replay(replace(walk, plates=(plate,))).plates[0] for plate in (walk.plates[1], off)
    )
    np.testing.assert_allclose(shown.force, true.force, atol=3.0)
    loaded = true.force[:, 1] > 100
    np.testing.assert_allclose(shown.cop[loaded], true.cop[loaded], atol=0.01)
    assert np.isnan(shown.cop[true.force[:, 1] < 10]).all()


def test_a_plate_that_only_hums_presses_nowhere():
    plate = force_plate(samples=1000)
    up = 45 * np.sin(2 * np.pi * 50 * plate.times)
    up[300:500] += 700
    point = np.where(up[:, None] > 20, [0.1, 0.0, 0.2], np.nan)
    force = np.column_stack([0 * up, up, 0 * up])
    moment = np.cross(np.nan_to_num(point), force)
    humming = replace(plate, force_ground=force, moment_ground=moment, cop_ground=point)
    shown = unfitted_replay(replace(capture(frames=100), plates=(humming,))).plates[0]
    pressed = np.isfinite(shown.cop).all(axis=1)
    assert pressed[31:49].all()
    assert not pressed[:29].any()
    assert not pressed[51:].any()


def test_forces_that_end_early_are_unknown_not_zero():
    plate = unfitted_replay(capture(samples=50)).plates[0]
    assert np.isnan(plate.force[5:]).all()
    assert np.isfinite(plate.force[:5]).all()


def test_without_a_fit_there_are_no_errors_and_no_bodies():
    replay = unfitted_replay(capture())
    assert np.isnan(replay.markers.errors).all()
    assert replay.bodies is None
    assert replay.residual is None
    assert replay.plates[0].foot.tolist() == [-1] * 10
    assert replay.notes == ("header says otherwise",)
    np.testing.assert_allclose(replay.times, 1.0 + np.arange(10) / 100)


def test_a_fit_brings_bodies_model_markers_residuals_and_limits(small_fit):
    replay = fitted_replay(small_fit.trials[0], small_fit.skeleton, PERSON, small_fit.settings)
    assert replay.bodies is not None
    assert replay.bodies.names == ("thigh",)
    rotations = Rotation.from_quat(replay.bodies.wxyz[:, 0][:, [1, 2, 3, 0]])
    np.testing.assert_allclose(rotations.as_rotvec()[:, 2], [0.0, 0.1, 0.2, 0.3], atol=1e-12)
    np.testing.assert_allclose(replay.bodies.position[0, 0], [0.1, 0.9, 1 / 3])
    np.testing.assert_array_equal(replay.markers.model[:, 0], np.ones((4, 3)))
    assert np.isnan(replay.markers.model[:, 1]).all()  # the model has no PSIS
    np.testing.assert_allclose(replay.markers.errors[0, 0], np.sqrt(1 + 0 + 1))
    assert replay.residual is not None
    assert replay.residual.force_limit == pytest.approx(0.05 * 980.665)
    assert replay.residual.moment_limit == pytest.approx(0.01 * 980.665 * 2.0)
    np.testing.assert_array_equal(replay.residual.used, [True, False, True, True])
    np.testing.assert_array_equal(replay.residual.force[:, 0], [3, 1000, 0, 0])
    np.testing.assert_allclose(replay.missing.of_all, np.linalg.norm(replay.residual.force, axis=1))
    assert replay.most_missing(0, 4, "thigh").frame == 1, "where the force does not count"
    assert replay.most_missing(2, 4, None).newtons == pytest.approx(12.0)
    assert np.isnan(replay.joint_loads.of_bodies).all(), "the root hangs from no joint"
    assert replay.notes == ("plate 1 was not tared",)


def test_a_trial_without_forces_has_no_residual(small_fit):
    replay = fitted_replay(small_fit.trials[1], small_fit.skeleton, PERSON, small_fit.settings)
    assert replay.residual is None
    assert replay.missing is replay.joint_loads is None
    assert replay.plates == ()
    assert replay.bodies is not None


def test_feet_of_plates_are_those_of_the_fit(small_fit):
    trial = small_fit.trials[0]
    with_plate = replace(
        trial,
        capture=replace(trial.capture, plates=(force_plate(start=0.2),)),
        contacts=replace(trial.contacts, plate=np.array([[0], [-1], [0], [0]])),
    )
    replay = fitted_replay(with_plate, small_fit.skeleton, PERSON, small_fit.settings)
    assert replay.feet == ("thigh",)
    assert replay.plates[0].foot.tolist() == [0, -1, 0, 0]


def test_frames_outside_the_fit_have_no_skeleton(small_fit):
    trial = small_fit.trials[0]
    later = replace(trial, motion=replace(trial.motion, start_time=0.27))
    replay = fitted_replay(later, small_fit.skeleton, PERSON, small_fit.settings)
    assert replay.frames == 4
    assert np.isnan(replay.bodies.position[:2]).all()
    assert np.isnan(replay.markers.model[:2]).all()
    assert np.isnan(replay.residual.force[:2]).all()
    assert not replay.residual.used[:2].any()
    np.testing.assert_allclose(
        Rotation.from_quat(replay.bodies.wxyz[2:, 0][:, [1, 2, 3, 0]]).as_rotvec()[:, 2],
        [0.0, 0.1],
        atol=1e-12,
    )
