"""`addb-viewer convert`: the files it names are there, what is lost is told, errors are one line."""

import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from solver.capture.capture import Markers
from solver.capture.formats.trc import read_trc
from solver.export.c3d_file import C3dRecording, FootEvent, write_c3d


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
