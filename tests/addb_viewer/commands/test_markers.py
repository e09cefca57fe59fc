"""`addb-viewer markers`: the printed rows, the map, and what a person changed in it."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.markers.mapping_file import read_map
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions

LABELS = ("RASI", "LASI", "SACR", "RKNE", "LKNE", "RANK", "LANK", "RHEE", "LHEE", "C7")


@pytest.fixture
def folder(tmp_path):
    body = default_skeleton()
    x = marker_positions(body, np.repeat(body.default_q[None], 20, axis=0))
    columns = [body.marker_names.index(n) for n in LABELS]
    blob = np.linspace(0, 1, 20)[:, None, None] * np.ones((1, 1, 3)) + 0.2
    markers = Markers((*LABELS, "M17"), np.concatenate([x[:, columns], blob], axis=1), 100.0)
    write_trc(tmp_path / "stand.trc", markers)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_it_prints_each_label_and_writes_the_map(folder):
    done = run("markers", folder, "--json", folder / "found.json")
    assert done.exit_code == 0, done.output
    assert "10 of 11 labels understood" in done.output
    assert read_map(folder / "markers.toml")["LKNE"] == "knee_lateral_l"
    assert read_map(folder / "markers.toml")["M17"] == ""
    found = {row["label"]: row for row in json.loads((folder / "found.json").read_text())["labels"]}
    assert found["RHEE"]["body"] == "calcn_r"
    assert found["M17"]["landmark"] is None


def test_what_a_person_wrote_stays(folder):
    run("markers", folder)
    file = folder / "markers.toml"
    file.write_text(file.read_text().replace('"M17" = ""', '"M17" = "t10"'))
    done = run("markers", folder)
    assert "the map says so" in done.output
    assert read_map(file)["M17"] == "t10"


def test_no_write_leaves_nothing_behind(folder):
    assert run("markers", folder, "--no-write").exit_code == 0
    assert not (folder / "markers.toml").exists()


def test_a_broken_map_is_one_line(folder):
    (folder / "markers.toml").write_text("[markers\n")
    done = run("markers", folder)
    assert done.exit_code == 1
    assert "markers.toml" in done.stderr


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('"RKNE" = "knee_latral_r"', "Nearest: knee_lateral_r"),
        ('"RKNE" = "knee_lateral_r"\n"M17" = "knee_lateral_r"', "both M17 and RKNE"),
        ('R.Knee.Lat = "knee_lateral_r"', '"R.Knee.Lat" = "landmark"'),
    ],
)
def test_what_a_fit_would_refuse_is_refused_here(folder, line, said):
    (folder / "markers.toml").write_text(f"[markers]\n{line}\n")
    done = run("markers", folder)
    assert done.exit_code == 1
    assert said in " ".join(done.stderr.split())
    assert (folder / "markers.toml").read_text() == f"[markers]\n{line}\n"


def test_a_label_that_no_recording_has_is_named(folder):
    (folder / "markers.toml").write_text('[markers]\n"RKNEE" = "knee_lateral_r"\n')
    done = run("markers", folder)
    assert done.exit_code == 0
    assert "'RKNEE' (nearest: 'RKNE')" in done.output


def test_what_the_map_leaves_out_is_not_counted(folder):
    (folder / "markers.toml").write_text('[markers]\n"RKNE" = ""\n')
    assert "9 of 11 labels understood" in run("markers", folder).output


def test_long_reasons_leave_room_for_the_labels(folder, monkeypatch):
    monkeypatch.setattr("addb_viewer.commands.describe.WIDTH_OF_A_PIPE", 80)
    lines = run("markers", folder).output.splitlines()
    for label, landmark in (("LKNE", "knee_lateral_l"), ("C7", "c7")):
        assert any(line.split()[:2] == [label, landmark] for line in lines)


def test_landmarks_are_listed_without_a_subject():
    done = run("markers", "--landmarks")
    assert done.exit_code == 0
    assert "fibula_head_l" in done.output
