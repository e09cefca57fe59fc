"""MCAP files, read back with mcap's own reader and compared with the fit."""

import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from addb_viewer.recordings.mcap_recording import write_mcap
from addb_viewer.recordings.mcap_schemas import SCHEMAS
from addb_viewer.trial_view.drawn_curves import METRES_PER_NEWTON
from addb_viewer.trial_view.recorded_subject import recording_of
from addb_viewer.trial_view.solver_steps import stages_of
from annotations import event_codec
from solver.common.typed_json import plain
from solver.fitting.settings import Settings, as_toml, read_settings
from solver.fitting.summary import summary
from solver.skeleton.forward import body_poses
from solver.skeleton.osim import load_skeleton

FRAMES, RATE, START = 40, 50.0, 0.35
TIMES_NS = [round((START + i / RATE) * 1e9) for i in range(FRAMES)]
POINT = np.dtype([("xyz", "<f4", 3), ("error", "<f4"), ("rgba", "u1", 4)])


class Read:
    """Messages by topic: their times, and their contents decoded by their schemas."""

    def __init__(self, file):
        self.times, self.messages, self.schemas = defaultdict(list), defaultdict(list), {}
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            self.summary = reader.get_summary()
            for schema, channel, message in reader.iter_messages():
                self.times[channel.topic].append(message.log_time)
                self.schemas[channel.topic] = schema
                decoded = message.data
                if channel.message_encoding == "json":
                    decoded = json.loads(decoded)
                self.messages[channel.topic].append(decoded)
            for schema, channel, _, told in reader.iter_decoded_messages(
                topics=[t for t, s in self.schemas.items() if s.encoding == "protobuf"]
            ):
                assert schema.name == self.schemas[channel.topic].name
                self.messages[channel.topic].append(told)
            for topic, schema in self.schemas.items():
                if schema.encoding == "protobuf":
                    self.messages[topic] = self.messages[topic][len(self.times[topic]) :]
            self.attachments = {a.name: a.data.decode() for a in reader.iter_attachments()}
            self.metadata = {m.name: m.metadata for m in reader.iter_metadata()}


@pytest.fixture
def read(recording, tmp_path):
    return Read(write_mcap(recording, tmp_path / "walk.mcap"))


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def test_every_schema_is_well_known_or_a_valid_schema_with_a_title(read):
    for topic, schema in read.schemas.items():
        if schema.encoding == "protobuf":
            assert schema.name.startswith("foxglove."), topic
            continue
        told = json.loads(schema.data)
        Draft202012Validator.check_schema(told)
        assert schema.encoding == "jsonschema"
        assert told["title"] == schema.name
        for message in read.messages[topic]:
            Draft202012Validator(told).validate(message)
    assert {s.name for s in read.schemas.values() if s.encoding == "jsonschema"} == set(SCHEMAS)


def test_frames_have_the_times_of_the_recordings_clock(read):
    for topic in (
        "markers",
        "model_markers",
        "transforms",
        "forces",
        "residual",
        "marker_error",
        "plate_forces",
    ):
        assert read.times[f"/walk/{topic}"] == TIMES_NS
    stamp = read.messages["/walk/markers"][7].timestamp
    assert stamp.seconds * 10**9 + stamp.nanos == TIMES_NS[7]


def test_markers(read, replay):
    names = read.metadata["walk markers"]
    assert [names[str(i)] for i in range(len(names))] == list(replay.markers.names)
    for topic, expected in (("markers", replay.markers.measured), ("model_markers", replay.markers.model)):
        clouds = read.messages[f"/walk/{topic}"]
        for frame, cloud in enumerate(clouds):
            points = np.frombuffer(cloud.data, POINT)
            assert cloud.point_stride == POINT.itemsize
            np.testing.assert_allclose(points["xyz"], expected[frame], rtol=1e-6, atol=1e-7)
            np.testing.assert_allclose(points["error"], replay.markers.errors[frame], rtol=1e-6)
    fields = {f.name: (f.offset, f.type) for f in clouds[0].fields}
    assert fields == {
        **{name: (4 * i, 7) for i, name in enumerate(("x", "y", "z", "error"))},
        **{name: (16 + i, 1) for i, name in enumerate(("red", "green", "blue", "alpha"))},
    }


def test_transforms(read, skeleton, q):
    R, p = body_poses(skeleton, q)
    for frame, told in enumerate(read.messages["/walk/transforms"]):
        assert [t.child_frame_id for t in told.transforms] == ["walk/pelvis", "walk/calcn_r"]
        assert {t.parent_frame_id for t in told.transforms} == {"ground"}
        for body, t in enumerate(told.transforms):
            np.testing.assert_allclose(
                [t.translation.x, t.translation.y, t.translation.z], p[frame, body], rtol=1e-6, atol=1e-7
            )
            turned = Rotation.from_quat([t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w])
            np.testing.assert_allclose(turned.as_matrix(), R[frame, body], atol=1e-6)


def test_an_arrow_points_along_its_force_and_is_as_long(read, replay):
    shown = 0
    for frame, update in enumerate(read.messages["/walk/forces"]):
        arrows = {entity.id: entity.arrows[0] for entity in update.entities}
        gone = {deletion.id for deletion in update.deletions}
        for plate in replay.plates:
            force, name = plate.force[frame], f"force {plate.name}"
            if np.linalg.norm(force) < 20:
                assert name in gone
                continue
            arrow, shown = arrows[name], shown + 1
            o, s = arrow.pose.orientation, arrow.pose.position
            along = Rotation.from_quat([o.x, o.y, o.z, o.w]).apply([1.0, 0, 0])
            length = (arrow.shaft_length + arrow.head_length) / METRES_PER_NEWTON
            np.testing.assert_allclose(length * along, force, rtol=1e-9)
            np.testing.assert_allclose([s.x, s.y, s.z], plate.cop[frame])
        assert ("residual force" in arrows) == bool(replay.residual.used[frame])
    assert shown > 30


def test_joints_have_angles_and_torques_in_words(read, make_fit):
    trial = make_fit("walk").trials[0]
    knee = trial.motion.dofs.index("knee")
    for frame, told in enumerate(read.messages["/walk/joints"]):
        assert np.radians(told["angles_deg"]["knee_angle"]) == pytest.approx(
            trial.dynamics.motion.q[frame, knee]
        )
        torque = trial.dynamics.joint_torques[frame, knee]
        assert told["torques_Nm"] == {"knee_torque": pytest.approx(torque, abs=1e-6)}
        assert told["used"] == trial.dynamics.used[frame]
    assert len(read.messages["/walk/joints"]) == FRAMES


def test_residuals_and_marker_errors(read, make_fit):
    trial = make_fit("walk").trials[0]
    for frame, told in enumerate(read.messages["/walk/residual"]):
        expected = trial.dynamics.residual_root[frame]
        np.testing.assert_allclose(told["force_N"] + told["moment_Nm"], expected, atol=1e-6)
        assert told["force_norm_N"] == pytest.approx(np.linalg.norm(expected[:3]), abs=1e-6)
        assert told["used"] is bool(trial.dynamics.used[frame])
        assert told["frame"] == frame
    told = read.messages["/walk/marker_error"]
    np.testing.assert_allclose([t["rms_m"] for t in told], trial.marker_errors.rms_per_frame, atol=1e-6)
    before = trial.kinematics_only.marker_errors.rms_per_frame
    np.testing.assert_allclose([t["before_rms_m"] for t in told], before, atol=1e-6)
    worst = [trial.marker_errors.names[i] for i in np.nanargmax(trial.marker_errors.distance, axis=1)]
    assert [t["worst"] for t in told] == worst


def test_plates_as_measured(read, replay):
    for frame, told in enumerate(read.messages["/walk/plate_forces"]):
        for plate, at in zip(replay.plates, told["plates"], strict=True):
            np.testing.assert_allclose(at["force_N"], plate.force[frame], atol=1e-6)
            assert (at["cop_m"] is None) == bool(np.isnan(plate.cop[frame, 0]))
        assert told["plates"][0]["foot"] == "calcn_r"
        assert told["plates"][1]["foot"] is None


def test_flags_causes_log_edits_and_progress(read, recording, edits):
    (flag,) = read.messages["/walk/flags"]
    assert (flag["range"], flag["foot"], flag["reason"]) == ([30, 36], "calcn_r", "notOverForcePlate")
    assert read.times["/walk/flags"] == [TIMES_NS[30]]
    assert [c["range"] for c in read.messages["/walk/causes"]] == [[2, 12], [20, 40]]
    log = [(m.name, m.level, m.message) for m in read.messages["/walk/log"]]
    assert ("note", 2, "y is up") in log
    assert any(name == "flag" and level == 3 for name, level, _ in log)
    written = read.messages["/review/edits"]
    assert [(e["number"], e["trial"], e["author"], e["made_at"]) for e in written] == [
        (e.number, e.trial, e.author, e.made_at.isoformat()) for e in edits
    ]
    assert [event_codec.decoded(e["kind"], e["content"]) for e in written] == [e.event for e in edits]
    (trial,) = recording.trials
    assert read.messages["/solver/progress"] == [
        {"stage": s.stage, "fraction": s.fraction, "seconds": s.seconds, "values": s.values}
        for s in stages_of(trial.figures, trial.costs)
    ]


def test_attachments_repeat_the_fit(read, recording, skeleton, tmp_path):
    (tmp_path / "settings.toml").write_text(read.attachments["settings.toml"])
    assert as_toml(read_settings(tmp_path / "settings.toml")) == as_toml(Settings())
    (tmp_path / "model.osim").write_text(read.attachments["model.osim"])
    assert load_skeleton(tmp_path / "model.osim").mass == pytest.approx(skeleton.mass)
    missing = json.loads(read.attachments["walk/review.json"])["missing_grf_data"]
    assert missing == [30 <= frame < 36 for frame in range(FRAMES)]
    assert json.loads(read.attachments["fit.json"]) == json.loads(json.dumps(plain(summary(recording.fit))))
    assert json.loads(read.attachments["diagnosis.json"])["verdict"] == "explained"


def test_the_file_is_indexed_in_small_chunks(read):
    assert read.summary.statistics.message_count == sum(map(len, read.times.values()))
    sizes = [c.uncompressed_size for c in read.summary.chunk_indexes]
    assert max(sizes) < 80 * 1024 < sum(sizes), "64 KiB, and what the last message has beyond"
    assert read.metadata["about"]["subject"] == "Zoë"


def test_trials_stand_beside_each_other(make_fit, tmp_path):
    read = Read(write_mcap(recording_of(make_fit("walk", "run/2")), tmp_path / "both.mcap"))
    assert read.times["/walk/markers"] == read.times["/run%2f2/markers"] == TIMES_NS
    assert {t.child_frame_id for t in read.messages["/run%2f2/transforms"][0].transforms} == {
        "run%2f2/pelvis",
        "run%2f2/calcn_r",
    }


def test_a_clock_that_starts_below_zero_is_shifted_and_says_so(make_fit, tmp_path):
    fit = make_fit("walk")
    trial = fit.trials[0]
    early = replace(trial.capture, markers=replace(trial.capture.markers, start_time=-0.2))
    shifted = replace(trial, capture=early, motion=replace(trial.motion, start_time=-0.2))
    read = Read(write_mcap(recording_of(replace(fit, trials=(shifted,))), tmp_path / "walk.mcap"))
    assert read.times["/walk/markers"][:2] == [0, 20_000_000]
    assert read.metadata["about"]["clock_zero_ns"] == "200000000"
    assert read.messages["/walk/residual"][0]["time_s"] == pytest.approx(-0.2)


def test_the_page_names_every_topic_schema_and_attachment(read):
    page = (Path(__file__).parents[3] / "docs" / "reference" / "recordings.md").read_text(encoding="utf-8")
    for topic in read.schemas:
        assert f"`{topic.replace('/walk/', '/TRIAL/')}`" in page
    for schema in read.schemas.values():
        assert f"`{schema.name}`" in page
    for name in read.attachments:
        assert f"`{name.replace('walk/', 'TRIAL/')}`" in page


def test_analog_channels_have_every_sample_at_its_time_with_all_its_digits(read, analog):
    found = read.messages["/walk/analog"]
    np.testing.assert_array_equal([m["values"]["VL"] for m in found], analog.values[:, 0])
    np.testing.assert_array_equal([m["values"]["trigger 1"] for m in found], analog.values[:, 1])
    assert read.times["/walk/analog"] == [500_000 * k for k in range(len(found))]
    assert [m["time_s"] for m in found] == pytest.approx(np.arange(len(found)) / 2000, abs=1e-12)
    assert read.metadata["walk analog"] == {"VL": "V", "trigger 1": ""}


def test_a_recording_that_is_gone_costs_its_analog_channels_and_the_log_says_so(recording, tmp_path):
    recording.trials[0].files[0].unlink()
    read = Read(write_mcap(recording, tmp_path / "walk.mcap"))
    assert "/walk/analog" not in read.times
    assert any("analog channels are not written" in m.message for m in read.messages["/walk/log"])
