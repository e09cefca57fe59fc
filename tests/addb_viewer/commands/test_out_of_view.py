"""Whoever walks out of view and comes back has no pose meanwhile, in whatever is written of the fit."""

import csv
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer import Subject
from addb_viewer.cli import app
from solver.simulate.demo import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.subject_folder import write_subject
from solver.simulate.trial import Scenario, simulate_trial

UNSEEN = ((0, 30), (70, 100))
SECONDS = 1.6


def run(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    who = Person(sex="male")
    body_rng, motion_rng, noise_rng = np.random.default_rng(8).spawn(3)
    trial = simulate_trial(Scenario("walk", "walk", duration=SECONDS), body_of(who, body_rng), motion_rng)
    plates = plates_under(trial.contacts, (0.0, SECONDS))
    walk = measure(trial, plates, MARKERS, MeasurementSettings(), noise_rng)
    x = walk.markers.positions_ground.copy()
    for start, end in UNSEEN:
        x[start:end] = np.nan
    folder = tmp_path_factory.mktemp("passer_by")
    write_subject(folder, who, [replace(walk, markers=replace(walk.markers, positions_ground=x))])
    (folder / "settings.toml").write_text("[trajectory]\nenabled = false\n")
    told = run("fit", folder, "--notes")
    assert "no pose on 60 of" in told
    return folder


def unseen(frames):
    outside = np.zeros(frames, dtype=bool)
    for start, end in UNSEEN:
        outside[start:end] = True
    return outside


def test_arrays_are_nan(folder):
    trial = Subject.open(folder).fit()[0]
    for values in map(np.asarray, (trial.com.values, trial.coordinates.values, trial.torques.values)):
        assert np.array_equal(np.isnan(values).any(axis=1), unseen(len(values)))


def test_tables_and_scenes(folder):
    for kind in ("csv", "gltf", "b3d", "c3d", "mujoco", "opensim", "parquet"):
        run("export", folder, "--to", kind)
    with (folder / "results" / "csv" / "walk.csv").open() as file:
        rows = list(csv.DictReader(file))
    blank = [row["pelvis_tilt_rad"] == "" for row in rows]
    assert blank == unseen(len(rows)).tolist()
    glb = (folder / "results" / "gltf" / "walk.glb").read_bytes()
    tree = json.loads(glb[20 : 20 + struct.unpack("<I", glb[12:16])[0]])
    keys = tree["accessors"][tree["animations"][0]["samplers"][0]["input"]]
    assert keys["count"] == len(rows) - sum(end - start for start, end in UNSEEN)
    assert keys["min"] == pytest.approx([0.3])


def test_pages_and_recordings(folder, tmp_path):
    run("report", folder)
    run("record", folder, "--rrd", tmp_path / "walk.rrd", "--mcap", tmp_path / "walk.mcap")
    assert (tmp_path / "walk.rrd").stat().st_size > 0
    assert (tmp_path / "walk.mcap").stat().st_size > 0
