"""`addb-viewer init`, `markers` and `settings`: what they write and print of a subject."""

import json
import shutil
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.jobs.root_folder import open_root
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.settings import Settings, as_toml
from solver.markers.mapping_file import read_map
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions


@pytest.fixture
def bare(real_data, tmp_path):
    """Copies of real folders without their subject.toml."""

    def copied(*names):
        for name in names:
            shutil.copytree(
                real_data / name, tmp_path / "Labor Süd" / name, ignore=shutil.ignore_patterns("subject.toml")
            )
        return tmp_path / "Labor Süd"

    return copied


@pytest.mark.parametrize(
    "name",
    [
        "opencap_subject4",
        "opencap_reviewed",
        "exo_apo_gordon",
        "run_treadmill_hamner2013_subject04",
        "sprint_overground_dorn2012_JA1_9ms",
        "walk_rajagopal2015",
        "c3d_lab_trials/lasem_FAILT01",
    ],
)
def test_what_is_written_reads_as_what_was_understood(bare, name):
    folder = bare(name) / name
    understood = open_subject(folder)
    done = run("init", folder)
    assert done.exit_code == 0, done.output
    assert f"{len(understood.trials)} trial" in done.stdout
    text = (folder / "subject.toml").read_text(encoding="utf-8")
    for file in understood.unused:
        assert f"# - {file.file}: {file.reason}" in text
    described = open_subject(folder)
    told = {"notes": (), "unused": (), "other_statics": (), "is_described": True}
    assert replace(described, **told) == replace(understood, **told)
    assert {file.file for file in described.unused} == {file.file for file in understood.unused}


def test_an_existing_description_is_never_written_over(bare):
    folder = bare("opencap_subject6") / "opencap_subject6"
    (folder / "subject.toml").write_text("mass_kg = 59.0\n")
    done = run("init", folder)
    assert done.exit_code == 1
    assert "never written over" in done.stderr
    assert (folder / "subject.toml").read_text() == "mass_kg = 59.0\n"


def test_awkward_names_survive(bare, real_data):
    folder = bare("opencap_subject6") / "opencap_subject6"
    (folder / "walking1.trc").rename(folder / 'Gang "schnell" #1.trc')
    (folder / "walking1_forces.mot").rename(folder / 'Gang "schnell" #1_forces.mot')
    understood = open_subject(folder)
    assert run("init", folder).exit_code == 0
    assert open_subject(folder).trials == understood.trials


def test_recursive_describes_every_subject_that_the_app_opens(bare):
    root = bare("anomalies", "opencap_subject4", "opencap_subject6", "exo_apo_gordon", "models")
    shown = open_root(root).names
    assert set(shown) == {
        "anomalies/UpsideDownData",
        "anomalies/tiziana2019_lencioni",
        "exo_apo_gordon",
        "opencap_subject4",
        "opencap_subject6",
    }
    (root / "opencap_subject6" / "subject.toml").write_text("mass_kg = 59.0\n")
    done = run("init", "--recursive", root)
    assert done.exit_code == 0, done.output
    assert "opencap_subject6/subject.toml: there already" in done.stdout
    assert "models is left out" in done.stdout
    written = {
        path.parent.relative_to(root.resolve()).as_posix() for path in root.resolve().rglob("subject.toml")
    }
    assert written == set(shown)
    assert open_root(root).names == shown


def test_the_only_subject_in_a_folder_is_described_as_if_it_were_given(bare):
    root = bare("opencap_subject6")
    (root / "opencap_subject6").rename(root / "2012-10-17")
    done = run("init", root)
    assert done.exit_code == 0, done.output
    assert (root / "2012-10-17" / "subject.toml").is_file()
    assert not (root / "subject.toml").exists()


def test_of_several_subjects_all_are_named_and_none_is_described(bare):
    root = bare("opencap_subject4", "opencap_subject6")
    done = run("init", root)
    assert done.exit_code == 1
    assert (
        "2 subjects: opencap_subject4, opencap_subject6. Give one of them, or add --recursive" in done.stderr
    )
    assert not list(root.rglob("subject.toml"))


def test_a_trial_that_cannot_be_read_is_told_where_the_folder_is_described(bare):
    folder = bare("c3d_lab_trials/lasem_FAILT01") / "c3d_lab_trials/lasem_FAILT01"
    whole = folder / "FAILT01_Walk01.c3d"
    (folder / "cut.c3d").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    done = run("init", folder)
    assert done.exit_code == 0, done.output
    assert "; cannot be read: cut" in done.stdout
    reason = "cut: a fit will leave it out: "
    assert reason in done.stdout
    assert reason in (folder / "subject.toml").read_text(encoding="utf-8")
    assert "cut off in frame" in done.stdout


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


def test_the_defaults(command_line):
    run = command_line("settings")
    assert run.exit_code == 0
    assert run.stdout == as_toml(Settings())
    assert tomllib.loads(run.stdout)["kinematics"]["iterations"] == Settings().kinematics.iterations


def test_a_subjects_own(command_line):
    (command_line.subject.folder / "settings.toml").write_text("[kinematics]\niterations = 3\n")
    run = command_line("settings", command_line.subject.folder)
    assert tomllib.loads(run.stdout)["kinematics"]["iterations"] == 3


def test_of_a_file_with_a_slip(command_line, tmp_path):
    (tmp_path / "mine.toml").write_text("[kinematik]\n")
    run = command_line("settings", "--settings", tmp_path / "mine.toml")
    assert run.exit_code == 1
    assert "nearest: kinematics" in run.stderr
