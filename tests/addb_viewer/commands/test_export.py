"""`addb-viewer export`, `convert` and `record`: what they write."""

import numpy as np
import pytest
from mcap.reader import make_reader
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from solver.capture.capture import Markers
from solver.capture.formats.trc import read_trc
from solver.export.c3d_file import C3dRecording, FootEvent, write_c3d


@pytest.fixture
def exported(monkeypatch):
    """What reached the exporter: (fit, folder)."""
    calls = []

    def export_opensim(fit, folder, muscles_from):
        calls.append((fit, folder))
        return [folder / "model.osim"]

    monkeypatch.setattr("addb_viewer.jobs.exporting.export_opensim", export_opensim)
    return calls


@pytest.mark.parametrize(
    ("to", "files"),
    [
        ("csv", ["csv/no_forces.csv", "csv/walk.csv"]),
        ("parquet", ["parquet/no_forces.parquet"]),
        ("gltf", ["gltf/walk.glb"]),
        ("mujoco", ["mujoco/model.xml", "mujoco/walk_motion.npz"]),
        ("c3d", ["c3d/walk.c3d"]),
    ],
)
def test_tables_and_scenes_go_into_a_folder_of_their_own(command_line, to, files):
    folder = command_line.subject.folder
    run = command_line("export", folder, "--to", to)
    assert run.exit_code == 0
    for name in files:
        assert str(folder / "results" / name) in run.stdout
        assert (folder / "results" / name).stat().st_size > 0


def test_b3d_is_one_file_beside_the_fit(command_line, monkeypatch):
    def export_b3d(fit, folder):
        (folder / "subject.b3d").write_bytes(b"b3d")
        return [folder / "subject.b3d"]

    monkeypatch.setattr("addb_viewer.jobs.exporting.export_b3d", export_b3d)
    folder = command_line.subject.folder
    assert command_line("export", folder, "--to", "b3d").exit_code == 0
    assert (folder / "results" / "subject.b3d").read_bytes() == b"b3d"


def test_a_model_that_b3d_cannot_hold_is_one_clear_line(command_line):
    run = command_line("export", command_line.subject.folder, "--to", "b3d")
    assert run.exit_code == 1
    assert "the root joint 'hip' has" in run.stderr
    assert "Traceback" not in run.stderr


def test_without_a_fit_it_solves_keeps_and_exports(command_line, exported):
    folder = command_line.subject.folder
    run = command_line("export", folder, "--to", "opensim")
    assert run.exit_code == 0
    assert run.stdout == f"{folder / 'results' / 'opensim' / 'model.osim'}\n"
    assert (folder / "results" / "fit.json").is_file()
    assert exported[0][0].mass_kg == 100.0


def test_a_current_fit_is_not_solved_again(command_line, exported):
    folder = command_line.subject.folder
    command_line("fit", folder)
    command_line("export", folder, "--to", "opensim")
    assert len(command_line.solves) == 1
    assert len(exported) == 1


def test_several_formats_are_written_by_one_command(command_line):
    folder = command_line.subject.folder
    run = command_line("export", folder, "--to", "csv", "--to", "c3d", "--to", "csv")
    assert run.exit_code == 0
    named = run.stdout.splitlines()
    for name in ("csv/walk.csv", "c3d/walk.c3d"):
        assert named.count(str(folder / "results" / name)) == 1
        assert (folder / "results" / name).stat().st_size > 0


def test_figures_do_not_replace_the_kept_fit(command_line):
    folder = command_line.subject.folder
    assert command_line("export", folder, "--to", "csv").exit_code == 0
    kept = folder / "results" / "fit.json"
    before = kept.read_bytes()
    run = command_line("fit", folder, "--json", kept)
    assert run.exit_code == 2
    assert kept.read_bytes() == before


@pytest.mark.parametrize("to", ["csv", "parquet", "gltf", "mujoco", "c3d", "opensim"])
@pytest.mark.parametrize("room", [4096, 8192, 16384, 32768])
def test_an_export_that_finds_no_room_leaves_what_was_there(command_line, small_disk, to, room):
    home = small_disk.folder / "results"
    kept = home / to / "walk.csv"
    kept.parent.mkdir(parents=True)
    kept.write_text("before")
    command_line("fit", command_line.subject.folder, "--out", home)
    before = {path: path.read_bytes() for path in home.rglob("*") if path.is_file()}
    small_disk.fill(but=room)
    run = command_line("export", command_line.subject.folder, "--to", to, "--out", home)
    if run.exit_code == 0:
        small_disk.empty()
        assert all(
            (home / line).is_file() for line in run.stdout.splitlines() if not line.startswith("note: ")
        )
        return
    assert "free some space" in run.stderr
    assert "Nothing was changed there." in run.stderr
    small_disk.empty()
    assert {path: path.read_bytes() for path in home.rglob("*") if path.is_file()} == before


@pytest.fixture
def c3d_file(tmp_path):
    heights = np.array([0.05, 0.05, 1.0, 1.7])
    positions = np.tile(np.column_stack([0.1 * heights, heights, 0.3 + 0.1 * heights]), (20, 1, 1))
    markers = Markers(("RHEE", "LHEE", "RASI", "HEAD"), positions, 100.0)
    events = (FootEvent(0.1, "Left", "Foot Strike"),)
    write_c3d(tmp_path / "walk.c3d", C3dRecording(markers, events=events))
    return tmp_path / "walk.c3d"


def run(*arguments):
    return CliRunner().invoke(app, ["convert", *map(str, arguments)])


def test_it_prints_what_it_wrote_and_what_is_lost(c3d_file):
    target = c3d_file.with_suffix(".trc")
    done = run(c3d_file, target)
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert lines[0] == str(target)
    assert "note: walk.trc: has no place for gait events of walk.c3d" in lines
    assert read_trc(target).markers.names == ("RHEE", "LHEE", "RASI", "HEAD")


def test_an_error_is_one_line_that_says_what_to_do(c3d_file):
    done = run(c3d_file, c3d_file.with_suffix(".glb"))
    assert done.exit_code == 1
    assert "Fit it first" in done.stderr
    assert "Traceback" not in done.stderr
    assert not c3d_file.with_suffix(".glb").exists()


def test_a_file_that_is_there_needs_overwrite(c3d_file):
    target = c3d_file.with_suffix(".trc")
    target.write_text("mine")
    assert run(c3d_file, target).exit_code == 1
    assert target.read_text() == "mine"
    assert run(c3d_file, target, "--overwrite").exit_code == 0
    assert target.read_text() != "mine"


def topics(file):
    with file.open("rb") as stream:
        return {channel.topic for channel in make_reader(stream).get_summary().channels.values()}


def test_record_writes_what_is_asked_for_and_says_where(command_line, tmp_path):
    folder = command_line.subject.folder
    done = command_line("record", folder, "--rrd", tmp_path / "a.rrd", "--mcap", tmp_path / "a.mcap")
    assert done.exit_code == 0, done.output
    assert done.output.splitlines() == [str(tmp_path / "a.mcap"), str(tmp_path / "a.rrd")]
    assert (tmp_path / "a.rrd").stat().st_size > 1000
    assert {"/walk/markers", "/no%2fforces/markers", "/walk/residual"} <= topics(tmp_path / "a.mcap")
    assert command_line.solves == [None], "there was no current fit"


def test_one_trial_of_a_fit_that_is_current_is_recorded_without_a_solve(command_line, tmp_path):
    folder = command_line.subject.folder
    command_line("fit", folder)
    done = command_line("record", folder, "--mcap", tmp_path / "a.mcap", "--trial", "walk")
    assert done.exit_code == 0, done.output
    assert len(command_line.solves) == 1
    assert not any(topic.startswith("/no") for topic in topics(tmp_path / "a.mcap"))


def test_record_needs_somewhere_to_write_to(command_line):
    done = command_line("record", command_line.subject.folder)
    assert done.exit_code == 2
    assert "--mcap" in done.output


@pytest.mark.parametrize(
    ("options", "said"), [(("--trial", "wlak"), "walk"), (("--mcap", "missing/a.mcap"), "missing/a.mcap")]
)
def test_what_is_wrong_is_one_line(command_line, tmp_path, options, said):
    given = options if "--mcap" in options else (*options, "--mcap", tmp_path / "a.mcap")
    done = command_line("record", command_line.subject.folder, *given)
    assert done.exit_code == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
