"""Rerun recordings, read back with rerun's own reader and compared with the fit."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from addb_viewer.recordings.rerun_program import rerun_command, rerun_environment
from addb_viewer.recordings.rrd_recording import write_rrd
from addb_viewer.trial_view.drawn_curves import METRES_PER_NEWTON
from addb_viewer.trial_view.recorded_subject import recording_of
from addb_viewer.trial_view.trial_events import lanes_of
from solver.capture.atomic import DRAFT
from solver.common.errors import CaptureError
from solver.common.gravity import GRAVITY
from solver.dynamics.thresholds import Thresholds
from solver.skeleton.forward import body_poses

chunk = pytest.importorskip("rerun.chunk")
FRAMES, RATE, START = 40, 50.0, 0.35
SINGLE = 2e-6  # relative error of single precision, with room for one operation


class Read:
    """What a recording holds, by entity and component: static values, and rows of a timeline."""

    def __init__(self, reader, store):
        self.static, self.rows = {}, {}
        for part in reader.stream(store=store):
            batch = part.to_record_batch()
            columns = {name: batch.column(name).to_pylist() for name in batch.schema.names}
            timeline = columns.get("frame", columns.get("solver_step", columns.get("time")))
            for name, values in columns.items():
                key = (str(part.entity_path), name)
                if part.is_static:
                    self.static.setdefault(key, []).extend(values)
                    continue
                told = zip(timeline, columns.get("time", timeline), values, strict=True)
                self.rows.setdefault(key, []).extend(row for row in told if row[2] is not None)

    def frames(self, place, name="Scalars:scalars"):
        return [frame for frame, _, _ in self.rows[(place, name)]]

    def seconds(self, place, name):
        return [time.total_seconds() for _, time, _ in self.rows[(place, name)]]

    def values(self, place, name="Scalars:scalars"):
        return [value for _, _, value in self.rows[(place, name)]]

    def by_frame(self, place, name="Scalars:scalars"):
        return dict(zip(self.frames(place, name), self.values(place, name), strict=True))


@pytest.fixture
def read(recording, tmp_path):
    reader = chunk.RrdReader(write_rrd(recording, tmp_path / "walk.rrd"))
    (store,) = reader.recordings()
    return Read(reader, store)


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def test_markers_are_where_they_were_measured_and_only_while_seen(read, replay):
    place, component = "/scene/markers", "Points3D:positions"
    assert read.frames(place, component) == list(range(FRAMES))
    times = START + np.arange(FRAMES) / RATE
    np.testing.assert_allclose(read.seconds(place, component), times, atol=1e-9)
    named, names = read.by_frame(place, "Points3D:labels"), None
    for frame, points in read.by_frame(place, component).items():
        names = named.get(frame, names)  # hold until the next ones
        measured = replay.markers.measured[frame]
        seen = np.isfinite(measured).all(axis=1)
        np.testing.assert_allclose(points, measured[seen], rtol=SINGLE, atol=1e-7)
        assert names == [name for name, s in zip(replay.markers.names, seen, strict=True) if s]
    assert sorted(named) == [0, 3, 9], "one marker is lost on frames 3 to 8"


@pytest.mark.parametrize(("which", "offset"), [("after", 0.0), ("before", 0.01)])
def test_bones_move_as_the_fit_and_the_marker_fit_before_it(read, skeleton, q, which, offset):
    R, p = body_poses(skeleton, q + offset)
    for body in range(2):
        place = f"/scene/{which}/bones/{skeleton.body_names[body]}"
        moved = np.array(read.values(place, "Transform3D:translation"))[:, 0]
        turned = np.array(read.values(place, "Transform3D:quaternion"))[:, 0]
        np.testing.assert_allclose(moved, p[:, body], rtol=SINGLE, atol=1e-7)
        np.testing.assert_allclose(Rotation.from_quat(turned).as_matrix(), R[:, body], atol=1e-6)
        assert len(read.static[(place, "Mesh3D:vertex_positions")]) == 1


def test_model_markers_are_those_of_the_fit(read, make_fit):
    expected, found = make_fit("walk").trials[0].model_markers_ground, []
    for body in ("pelvis", "calcn_r"):
        place = f"/scene/after/bones/{body}"
        moved = np.array(read.values(place, "Transform3D:translation"))
        turned = Rotation.from_quat(np.array(read.values(place, "Transform3D:quaternion"))[:, 0]).as_matrix()
        (on_body,) = read.static[(f"{place}/markers", "Points3D:positions")]
        found.append(moved + np.einsum("tij,mj->tmi", turned, np.array(on_body)))
    np.testing.assert_allclose(np.concatenate(found, axis=1), expected, atol=1e-6)


def test_forces_start_at_the_centre_of_pressure_of_their_foot(read, replay):
    first, second = replay.plates
    for place, plate in (("/scene/forces/calcn_r", first), ("/scene/forces/unassigned", second)):
        loaded = np.linalg.norm(plate.force, axis=1) > 20
        shown = read.values(place, "Arrows3D:vectors")
        assert [len(row) for row in shown] == loaded.astype(int).tolist()
        vectors = np.array([row[0] for row in shown if row]) / METRES_PER_NEWTON
        np.testing.assert_allclose(vectors, plate.force[loaded], rtol=SINGLE, atol=1e-4)
        starts = np.array([row[0] for row in read.values(place, "Arrows3D:origins") if row])
        np.testing.assert_allclose(starts, plate.cop[loaded], rtol=SINGLE, atol=1e-7)


def test_residuals_are_those_of_the_fit_with_gaps_where_forces_do_not_count(read, make_fit):
    dynamics = make_fit("walk").trials[0].dynamics
    for panel, part in (("residual_force", slice(0, 3)), ("residual_moment", slice(3, 6))):
        place = f"/series/{panel}/after"
        by_frame = read.by_frame(place)
        told = {frame: row[0] for frame, row in by_frame.items() if row}
        assert sorted(told) == np.flatnonzero(dynamics.used).tolist()
        norms = np.linalg.norm(dynamics.residual_root[:, part], axis=1)
        np.testing.assert_allclose([told[f] for f in sorted(told)], norms[dynamics.used])
        assert by_frame[30] == [], "the line ends where forces stop counting"


def test_bounds_are_those_of_hicks(read):
    limits, weight = Thresholds(), 40.0 * GRAVITY
    expected = {
        "residual_force": limits.linear_BW * weight,
        "residual_moment": limits.angular_BWh * weight * 1.6,
        "marker_error": 100 * limits.marker_rms_m,
    }
    for panel, limit in expected.items():
        place = f"/series/{panel}/threshold"
        assert read.frames(place) == [0, FRAMES - 1]
        np.testing.assert_allclose(read.values(place), [[limit], [limit]])


def test_marker_errors_in_centimetres(read, make_fit):
    errors = make_fit("walk").trials[0].marker_errors
    for curve, expected in (("after", errors.rms_per_frame), ("largest", errors.maximum_per_frame)):
        values = read.values(f"/series/marker_error/{curve}")
        np.testing.assert_allclose(np.ravel(values), 100 * expected)


def test_joints_have_angles_and_torques_in_words(read, make_fit):
    trial = make_fit("walk").trials[0]
    knee = trial.motion.dofs.index("knee")
    angle = np.ravel(read.values("/series/joint_angle/knee_angle"))
    np.testing.assert_allclose(np.radians(angle), trial.dynamics.motion.q[:, knee])
    torque = np.ravel(read.values("/series/joint_torque/knee_torque"))
    np.testing.assert_allclose(torque, trial.dynamics.joint_torques[:, knee])
    places = {place for place, _ in read.rows if place.startswith("/series/joint")}
    assert {place for place in places if "torque" in place} == {"/series/joint_torque/knee_torque"}
    assert len(places) == 5  # the root turns about three axes; its torques are the residual


def test_analog_channels_lie_on_the_recordings_time_sample_by_sample(read, analog):
    rows = read.rows[("/series/analog/VL", "Scalars:scalars")]
    np.testing.assert_array_equal([value for *_, (value,) in rows], analog.values[:, 0])
    times = [time.total_seconds() for time, *_ in rows]
    np.testing.assert_allclose(times, analog.times, atol=1e-6)
    assert read.static[("/series/analog/VL", "SeriesLines:names")] == [["VL [V]"]]


def test_flags_causes_and_proposals_are_lanes(read, recording):
    def lane(name):
        place = f"/lanes/{name}"
        return [(f, states[0]) for f, states in read.by_frame(place, "StateChange:state").items()]

    assert lane("force_missing_right") == [(30, "not over a plate"), (36, "")]
    cause = "forces shifted in time against the markers"
    assert lane("cause_1") == [(2, cause), (12, ""), (20, cause)]
    assert lane("forces_used") == [(0, "used"), (30, ""), (36, "used")]
    assert lane("proposed_by_detection") == [(5, "force wrong, 40 % sure"), (9, "")]
    assert len(lanes_of(recording.trials[0], recording.diagnosis)) == 5


def test_the_log_says_what_was_flagged_named_and_edited(read):
    texts = np.ravel(read.values("/log", "TextLog:text"))
    said = list(zip(read.frames("/log", "TextLog:text"), texts, strict=True))
    assert any(f == 30 and "not over a plate" in text and "review" in text for f, text in said)
    assert any(f == 20 and text.startswith("cause: frames 20 to 39: forces shifted") for f, text in said)
    assert any(f == 30 and "edit 3 by anna" in text for f, text in said)
    assert (0, "note: y is up") in said


def test_the_solver_has_a_timeline_of_its_own(read):
    assert read.frames("/solver/report", "TextLog:text") == [0, 1, 2, 3, 4]
    texts = np.ravel(read.values("/solver/report", "TextLog:text"))
    assert texts[0] == "load, 5 %, 0.10 s"
    assert texts[3] == "dynamics, iteration 1, 64 %, 1.35 s, cost 12.5"
    cost = np.ravel(read.values("/solver/cost"))
    np.testing.assert_array_equal(cost, [np.nan, np.nan, 90.0, 12.5, np.nan])
    np.testing.assert_allclose(np.ravel(read.values("/solver/seconds")), [0.1, 0.6, 0.6, 1.35, 2.1])


def test_several_trials_are_as_many_recordings_each_with_its_layout(make_fit, tmp_path):
    file = write_rrd(recording_of(make_fit("walk", "run/2")), tmp_path / "both.rrd")
    reader = chunk.RrdReader(file)
    assert sorted(store.recording_id for store in reader.recordings()) == ["Zoë, run/2", "Zoë, walk"]
    assert len(reader.blueprints()) == 2
    verified = subprocess.run(
        [*rerun_command(), "rrd", "verify", file],
        env=rerun_environment(tmp_path), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert verified.returncode == 0, verified.stderr
    assert "verified without error" in verified.stdout + verified.stderr


def test_a_failure_leaves_the_file_that_was_there(recording, tmp_path, monkeypatch):
    file = tmp_path / "walk.rrd"
    file.write_text("before")
    monkeypatch.setattr(
        "addb_viewer.recordings.rrd_recording.write_series",
        lambda stream, record: (_ for _ in ()).throw(ValueError("no")),
    )
    with pytest.raises(ValueError, match="no"):
        write_rrd(recording, file)
    assert file.read_text() == "before"
    assert [p.name for p in tmp_path.iterdir() if p.suffix == ".rrd"] == ["walk.rrd"]


def test_a_folder_that_is_not_there_is_named(recording, tmp_path):
    with pytest.raises(CaptureError, match="missing"):
        write_rrd(recording, tmp_path / "missing" / "walk.rrd")


@pytest.fixture
def two_trials(make_fit):
    fit = make_fit("walk")
    (trial,) = fit.trials
    other = replace(trial, capture=replace(trial.capture, name="walk 2"))
    return recording_of(replace(fit, trials=(trial, other)))


def test_trials_are_merged_where_the_recording_goes_not_in_the_folder_of_temporary_files(
    two_trials, tmp_path, small_disk, monkeypatch
):
    monkeypatch.setattr("tempfile.tempdir", str(small_disk.folder))
    small_disk.fill()
    reader = chunk.RrdReader(write_rrd(two_trials, tmp_path / "walk.rrd"))
    assert len(reader.recordings()) == 2
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["walk.rrd"]
    assert list(tmp_path.glob(f"{DRAFT}*")) == []


@pytest.mark.parametrize("but", [20_000, 100_000, 180_000, 260_000, 340_000])
def test_a_recording_that_finds_no_room_is_told_by_its_name_and_leaves_nothing(two_trials, small_disk, but):
    small_disk.fill(but=but)
    with pytest.raises(CaptureError, match=r"walk\.rrd: cannot write here \(No space left.*free some space"):
        write_rrd(two_trials, small_disk.folder / "walk.rrd")
    assert [path.name for path in small_disk.folder.iterdir()] == ["filler"]


def test_rerun_itself_writes_no_file(recording, tmp_path, monkeypatch):
    """Its own writer may hang for ever where the disk is full."""
    monkeypatch.delattr("rerun.RecordingStream.save")
    assert len(chunk.RrdReader(write_rrd(recording, tmp_path / "walk.rrd")).recordings()) == 1
