"""What the player gets."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from addb_viewer.report import scene_data
from addb_viewer.report.frames_kept import kept_frames
from addb_viewer.report.scene_data import Packed, arrows_of, grid, plates_of, scene_of, unpacked, walked_floor
from addb_viewer.trial_view.palette import CAUSE, GREEN, RESIDUAL
from addb_viewer.trial_view.replay import RequiredForce


@pytest.fixture
def scene(report):
    return scene_of(report.recording, report.kept)


def numbers(series, frames):
    return unpacked(Packed(**series), frames)


def test_positions_come_back_to_a_quarter_of_a_millimetre(report, scene):
    (trial,), replay = scene["trials"], report.recording.trials[0].replay
    for name, values in (("markers", replay.markers.measured), ("positions", replay.bodies.position)):
        back = numbers(trial[name], 40).reshape(values.shape)
        np.testing.assert_allclose(back, values, atol=0.26e-3)
    wxyz = numbers(trial["quaternions"], 40).reshape(40, 2, 4)
    turned = Rotation.from_quat(wxyz[..., [1, 2, 3, 0]].reshape(-1, 4))
    asked = Rotation.from_quat(replay.bodies.wxyz[..., [1, 2, 3, 0]].reshape(-1, 4))
    assert (turned * asked.inv()).magnitude().max() < 2e-4


def test_a_turn_that_changes_sign_is_the_same_turn_without_a_jump(report):
    (record,) = report.recording.trials
    bodies = record.replay.bodies
    flipped = bodies.wxyz * np.where(np.arange(40) % 3 == 1, -1.0, 1.0)[:, None, None]
    jumping = replace(record, replay=replace(record.replay, bodies=replace(bodies, wxyz=flipped)))
    trial = scene_of(replace(report.recording, trials=(jumping,)), report.kept)["trials"][0]
    wxyz = numbers(trial["quaternions"], 40).reshape(40, 2, 4)
    assert np.abs(np.diff(wxyz, axis=0)).max() < 0.2


def test_meshes_come_back_whole(report, scene):
    for name, mesh in zip(report.recording.fit.skeleton.body_names, scene["meshes"], strict=True):
        asked = report.recording.meshes[name]
        np.testing.assert_array_equal(numbers(mesh["faces"], mesh["faceCount"]), asked.faces)
        np.testing.assert_allclose(numbers(mesh["vertices"], mesh["count"]), asked.vertices, atol=1.1e-4)


def test_heavy_meshes_are_thinned(report, monkeypatch):
    monkeypatch.setattr(scene_data, "MOST_FACES", 800)
    heavy = {name: trimesh.creation.icosphere(4, 0.1) for name in report.recording.meshes}
    meshes = scene_of(replace(report.recording, meshes=heavy), report.kept)["meshes"]
    assert sum(mesh["faceCount"] for mesh in meshes) <= 900


def test_forces_flags_and_usable_frames(report, scene):
    (trial,), replay = scene["trials"], report.recording.trials[0].replay
    plate = next(arrow for arrow in trial["arrows"] if arrow["label"] == "plate 1")
    loaded = replay.plates[0].force[:, 1] > 100
    force = numbers(plate["force"], 40)
    np.testing.assert_array_equal(np.isfinite(force[:, 1]), loaded)
    np.testing.assert_allclose(force[loaded], replay.plates[0].force[loaded], atol=0.26)
    assert trial["kept"] == [[0, 30], [36, 40]]
    (flag,) = trial["flags"]
    assert (flag["start"], flag["end"], flag["foot"]) == (30, 36, 1)
    assert flag["words"] == "right foot: not over a plate, frames 30–35"


def test_model_markers_stand_on_their_bodies(report, scene):
    (trial,), replay = scene["trials"], report.recording.trials[0].replay
    assert len(trial["modelMarkers"]) == 6
    for own in trial["modelMarkers"]:
        path = replay.bodies.point_ground(own["body"], np.array(own["at"]))
        np.testing.assert_allclose(path, replay.markers.model[:, own["marker"]], atol=2e-4)


def test_long_recordings_play_every_other_frame(report, monkeypatch):
    monkeypatch.setattr(scene_data, "MOST_FRAMES", 25)
    trial = scene_of(report.recording, report.kept)["trials"][0]
    assert (trial["frames"], trial["every"], trial["rate"], trial["last"]) == (20, 2, 25.0, 39)
    back = numbers(trial["positions"], 20).reshape(20, 2, 3)
    np.testing.assert_allclose(back, report.recording.trials[0].replay.bodies.position[::2], atol=0.26e-3)


def test_a_trial_without_skeleton_or_forces_is_plain_json(report):
    (record,) = report.recording.trials
    bare = replace(record.replay, bodies=None, residual=None, plates=(), required=())
    recording = replace(report.recording, trials=(replace(record, replay=bare),), diagnosis=None)
    trial = json.loads(json.dumps(scene_of(recording, [kept_frames(bare)]), allow_nan=False))["trials"][0]
    assert (trial["positions"], trial["arrows"], trial["kept"]) == (None, [], [])


def test_a_grid_covers_its_corners_in_half_metres():
    lines = grid(np.array([-0.2, 0.1]), np.array([0.9, 0.7]))
    assert (lines[..., 1] == 0).all()
    assert lines[..., 0].min() == -0.5
    assert lines[..., 0].max() == 1.0
    assert sorted({float(a[0]) for a, b in lines if a[0] == b[0]}) == [-0.5, 0.0, 0.5, 1.0]
    assert sorted({float(a[2]) for a, b in lines if a[2] == b[2]}) == [0.0, 0.5, 1.0]


def test_the_floor_reaches_beyond_all_that_was_seen(recording):
    replay = recording.trials[0].replay
    lines, seen = walked_floor(replay), replay.markers.measured
    for axis in (0, 2):
        assert lines[..., axis].min() <= np.nanmin(seen[..., axis]) - 1.0
        assert lines[..., axis].max() >= np.nanmax(seen[..., axis]) + 1.0
    unseen = replace(replay, markers=replace(replay.markers, measured=seen * np.nan))
    assert len(walked_floor(unseen)) == 0


def test_plates_have_an_outline_or_at_least_a_trace(recording):
    replay = recording.trials[0].replay
    first, _ = plates_of(replay)
    np.testing.assert_array_equal(first.outline, replay.plates[0].corners[[0, 1, 2, 3, 0]])
    bare = replace(replay, plates=(replace(replay.plates[0], corners=None),))
    (only,) = plates_of(bare)
    assert len(only.outline) == 0
    loaded = replay.plates[0].force[:, 1] > 100
    np.testing.assert_array_equal(only.trace, replay.plates[0].cop[loaded])


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def test_measured_forces_have_the_colour_of_their_foot(replay):
    first = next(arrow for arrow in arrows_of(replay, None) if arrow.label == "plate 1")
    assert first.color == GREEN
    loaded = np.isfinite(first.force[:, 1])
    plate = replay.plates[0]
    np.testing.assert_array_equal(loaded, plate.force[:, 1] > 100)
    np.testing.assert_array_equal(first.force[loaded], plate.force[loaded])
    np.testing.assert_array_equal(first.start[loaded], plate.cop[loaded])


def test_the_residual_is_drawn_where_it_counts(replay):
    (residual,) = [a for a in arrows_of(replay, None) if a.color == RESIDUAL]
    np.testing.assert_array_equal(np.isfinite(residual.force[:, 0]), replay.residual.used)
    assert np.isfinite(residual.start[0]).all()


def test_what_the_motion_demands_is_told_apart_from_what_was_measured(replay):
    force = np.full((40, 3), np.nan)
    force[30:36] = [0.0, 300.0, 0.0]
    required = RequiredForce("calcn_r", force, np.zeros((40, 3)))
    (arrow,) = [a for a in arrows_of(replace(replay, required=(required,)), None) if a.is_required]
    np.testing.assert_array_equal(np.isfinite(arrow.force[:, 1]), ~replay.residual.used)


def test_a_named_force_is_there_while_it_acts(replay, effect, figures):
    contact = effect("external_contact", "pelvis", ((5, 9),), force_x_N=0.0, force_y_N=50.0, force_z_N=0.0)
    (arrow,) = [a for a in arrows_of(replay, figures(contact)) if a.color == CAUSE]
    assert np.flatnonzero(np.isfinite(arrow.force[:, 1])).tolist() == [5, 6, 7, 8]
    np.testing.assert_allclose(arrow.force[5], [0, 50, 0])
