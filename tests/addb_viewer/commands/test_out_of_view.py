"""Whoever walks out of view and comes back has no pose meanwhile, in whatever is written of the fit."""

import csv
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from typer.testing import CliRunner

from addb_viewer import Subject
from addb_viewer.commands.cli import app
from addb_viewer.trial_view.replay import BodySize
from addb_viewer.trial_view.replay_of_fit import fitted_replay
from solver.fitting.result_stage import without_impossible
from solver.fitting.seen_part import without_guesses
from solver.fitting.settings import Settings
from solver.fitting.tracking_stage import former_marker_fit
from solver.simulate.person import Person
from solver.simulate.subject_folder import write_subject
from tests.measured_walk import measured_walk

pytestmark = pytest.mark.slow  # their fixtures take long

UNSEEN = ((0, 30), (70, 100))
ARM = ("RELB", "RELM", "RFRM", "RWRA", "RWRB", "RFIN")
ARM_UNSEEN, ARM_BRIDGED = (110, 145), (40, 55)
ELBOW = "elbow_flex_r"
SECONDS = 1.6


def run(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    who = Person(sex="male")
    walk = measured_walk(who, seconds=SECONDS, seed=8)
    x = walk.markers.positions_ground.copy()
    for start, end in UNSEEN:
        x[start:end] = np.nan
    for start, end in (ARM_UNSEEN, ARM_BRIDGED):
        x[start:end, [walk.markers.names.index(name) for name in ARM]] = np.nan
    folder = tmp_path_factory.mktemp("passer_by")
    write_subject(folder, who, [replace(walk, markers=replace(walk.markers, positions_ground=x))])
    (folder / "settings.toml").write_text("[trajectory]\nenabled = false\n")
    told = run("fit", folder)
    assert "out of view (2):" in told
    told = run("fit", folder, "--notes", "--force")
    assert "no pose on 60 of" in told
    assert "elbow_flex_r, pro_sup_r, wrist_flex_r, wrist_dev_r in frames 110-144" in told
    return folder


def unseen(frames):
    outside = np.zeros(frames, dtype=bool)
    for start, end in UNSEEN:
        outside[start:end] = True
    return outside


def test_arrays_are_nan(folder):
    trial = Subject.open(folder).fit()[0]
    for values in map(np.asarray, (trial.com.values, trial.coordinates.values, trial.torques.values)):
        assert np.array_equal(np.isnan(values).all(axis=1), unseen(len(values)))


def test_a_joint_out_of_view_has_no_angle_and_no_torque_and_a_short_gap_is_marked_as_bridged(folder):
    trial = Subject.open(folder).fit()[0]
    nowhere = unseen(trial.frames)
    hidden, open_there = nowhere.copy(), nowhere.copy()
    hidden[slice(*ARM_UNSEEN)] = open_there[slice(*ARM_UNSEEN)] = open_there[slice(*ARM_BRIDGED)] = True
    for series in (trial.coordinates, trial.velocities, trial.torques, trial.powers):
        assert np.array_equal(np.isnan(series[ELBOW]), hidden)
        assert np.array_equal(np.isnan(series["elbow_flex_l"]), nowhere)
        assert np.array_equal(np.isnan(series["knee_angle_r"]), nowhere)
    assert np.array_equal(~trial.determined[ELBOW], open_there)
    assert np.array_equal(~trial.determined["knee_angle_r"], nowhere)
    solved = Subject.open(folder).fit().solved.trials[0].dynamics.motion
    for series, whole in ((trial.velocities, solved.velocity), (trial.accelerations, solved.acceleration)):
        known = np.isfinite(series.values)
        np.testing.assert_allclose(series.values[known], whole[known])  # a gap changes nothing beside it
    there = np.isfinite(trial.body_positions.values).all(axis=2)
    for hand, gone in (("hand_r", hidden), ("hand_l", nowhere)):
        assert np.array_equal(~there[:, trial.bodies.index(hand)], gone)
    (told,) = json.loads((folder / "results" / "fit.json").read_text())["trials"]
    assert told["coordinates_guessed_ranges"][ELBOW] == [list(ARM_UNSEEN)]


def test_an_angle_that_nobody_takes_is_not_told_and_a_note_says_where(folder):
    solved = Subject.open(folder).fit().solved
    trial = solved.trials[0]
    elbow, q = trial.motion.dofs.index("elbow_flex_l"), trial.motion.q.copy()
    q[60:63, elbow] = np.radians(-51)
    told = without_impossible(replace(trial, motion=replace(trial.motion, q=q)), solved.skeleton)
    angles, before = without_guesses(told).motion.q, without_guesses(trial).motion.q
    assert np.isnan(angles[60:63, elbow]).all()
    assert np.array_equal(np.delete(angles, elbow, 1), np.delete(before, elbow, 1), equal_nan=True)
    assert ["bend as nobody's does" in note for note in told.notes if "elbow_flex_l" in note] == [True]
    assert without_impossible(trial, solved.skeleton) is trial
    assert np.array_equal(former_marker_fit(told, solved.groundwork, Settings()).left_open, trial.left_open)


def test_the_app_draws_no_bone_and_no_curve_of_what_nobody_saw(folder):
    fit = Subject.open(folder).fit()
    size = BodySize(fit.mass_kg, fit.height_m)
    replay = fitted_replay(fit.solved.trials[0], fit.solved.skeleton, size, fit.solved.settings)
    drawn = np.isfinite(replay.bodies.position).all(axis=2)
    assert not drawn[slice(*ARM_UNSEEN), replay.bodies.names.index("hand_r")].any()
    assert drawn[slice(*ARM_UNSEEN), replay.bodies.names.index("hand_l")].all()
    elbow = replay.joints.names.index(ELBOW)
    assert np.isnan(replay.joints.position[slice(*ARM_UNSEEN), elbow]).all()
    assert np.isfinite(replay.joints.position[slice(*ARM_BRIDGED), elbow]).all()
    wrist, knee = (replay.markers.names.index(name) for name in ("RWRA", "RKNE"))
    assert np.isnan(replay.markers.model[slice(*ARM_UNSEEN), wrist]).all()
    assert np.isfinite(replay.markers.model[slice(*ARM_UNSEEN), knee]).all()


def test_tables_and_scenes(folder):
    for kind in ("csv", "gltf", "b3d", "c3d", "mujoco", "opensim", "parquet"):
        run("export", folder, "--to", kind)
    with (folder / "results" / "csv" / "walk.csv").open() as file:
        rows = list(csv.DictReader(file))
    blank = [row["pelvis_tilt_rad"] == "" for row in rows]
    assert blank == unseen(len(rows)).tolist()
    assert all(
        row["elbow_flex_r_rad"] == row["elbow_flex_r_moment_Nm"] == "" for row in rows[slice(*ARM_UNSEEN)]
    )
    motion = (folder / "results" / "opensim" / "walk_ik.mot").read_text()
    assert "nan" not in motion  # OpenSim needs whole poses
    glb = (folder / "results" / "gltf" / "walk.glb").read_bytes()
    tree = json.loads(glb[20 : 20 + struct.unpack("<I", glb[12:16])[0]])
    keys = tree["accessors"][tree["animations"][0]["samplers"][0]["input"]]
    assert keys["count"] == len(rows) - sum(end - start for start, end in UNSEEN)
    assert keys["min"] == pytest.approx([0.3])


def test_pages_and_recordings(folder, tmp_path):
    run("report", folder)
    run("record", folder, "--rrd", tmp_path / "walk.rrd", "--mcap", tmp_path / "walk.mcap")
    assert (tmp_path / "walk.rrd").stat().st_size > 0
    with (tmp_path / "walk.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        drawn, shown = set(), {}
        for _, _, message, update in reader.iter_decoded_messages(topics=["/walk/bones"]):
            drawn |= {entity.id for entity in update.entities}
            drawn -= {deletion.id for deletion in update.deletions}
            shown[round(message.log_time / 1e7)] = frozenset(drawn)
    assert list(shown) == [0, 30, 70, 100, 110, 145]  # at 100 frames a second
    assert ["bone hand_r" in shown[k] for k in shown] == [False, True, False, True, False, True]
    assert ["bone hand_l" in shown[k] for k in shown] == [False, True, False, True, True, True]


def test_the_models_markers_on_it_are_nowhere(folder):
    trial = Subject.open(folder).fit()[0]
    assert np.isnan(trial.model_markers["RWRA"][slice(*ARM_UNSEEN)]).all()
    assert np.isfinite(trial.model_markers["RKNE"][slice(*ARM_UNSEEN)]).all()
