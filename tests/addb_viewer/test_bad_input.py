"""Bad input through the command line: exit 1, one clear line, no traceback, nothing written.

What each reader refuses is tested beside it; here, that it comes out of the program so.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from tests.addb_viewer.shell import run

EXTERNAL_ENTITY = """<?xml version="1.0"?>
<!DOCTYPE m [<!ENTITY secret SYSTEM "file:///etc/hostname">]>
<OpenSimDocument Version="30000"><Model name="&secret;"></Model></OpenSimDocument>
"""


def write_walk(folder: Path, names: tuple[str, ...] = ("RASI", "LASI", "SACR")) -> Path:
    """Three markers that move 1 mm a frame at 100 Hz."""
    places = 0.1 * np.arange(9).reshape(3, 3) + 0.001 * np.arange(30)[:, None, None]
    write_trc(folder / "walk.trc", Markers(names, places, 100.0))
    return folder / "walk.trc"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A subject's folder, in a place whose name has spaces and accents."""
    folder = tmp_path / "Zoë's études" / "sujet nº 1"
    folder.mkdir(parents=True)
    return folder


def assert_refused(folder: Path, *said: str) -> None:
    """The fit fails with one line that says all of `said`, and the folder is as it was."""
    before = {path: path.stat().st_mtime_ns for path in folder.parent.rglob("*")}
    done = run("fit", folder, "--json", folder.parent / "figures.json")
    assert isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code == 1, done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    assert "unexpected" not in done.stderr
    assert done.stdout == ""
    for words in said:
        assert words in done.stderr
    assert {path: path.stat().st_mtime_ns for path in folder.parent.rglob("*")} == before


def test_a_trc_cut_off_inside_a_row(folder):
    path = write_walk(folder)
    whole = path.read_text()
    path.write_text(whole[: whole.rindex("\t")])
    assert_refused(folder, "walk.trc", "line")


def test_a_model_that_asks_for_another_files_content(folder):
    write_walk(folder)
    (folder / "model.osim").write_text(EXTERNAL_ENTITY)
    (folder / "subject.toml").write_text('model = "model.osim"\n[trials.walk]\nmarkers = "walk.trc"\n')
    assert_refused(folder, "model.osim")


def test_a_folder_without_trials(folder):
    assert_refused(folder, folder.name, "trial")


def test_a_folder_that_is_a_file(folder):
    assert_refused(write_walk(folder), "walk.trc")


def test_spaces_and_accents_reach_the_data(folder):
    """In a process of its own. The path opens; what fails is that no model knows three markers called so."""
    write_walk(folder, ("Épaule", "Café", "Où"))
    command = [sys.executable, "-m", "addb_viewer", "fit", folder]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "marker" in done.stderr
    assert "unexpected" not in done.stderr
