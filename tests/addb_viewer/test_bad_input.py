"""Bad input through the real command line: exit 1, one clear line, no traceback, nothing written.

What each reader refuses is tested beside it; here, that it comes out of the program so.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc

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


def fit(folder: Path, *options: object) -> tuple[int, str, str]:
    """Run `addb-viewer fit` in a process of its own: status, stdout, stderr."""
    command = [sys.executable, "-m", "addb_viewer", "fit", folder, *options]
    done = subprocess.run(
        [os.fspath(part) for part in command], capture_output=True, text=True, encoding="utf-8", check=False
    )
    return done.returncode, done.stdout, done.stderr


def assert_refused(folder: Path, *said: str) -> None:
    """The fit fails with one line that says all of `said`, and the folder is as it was."""
    before = {path: path.stat().st_mtime_ns for path in folder.parent.rglob("*")}
    status, out, error = fit(folder, "--json", folder.parent / "figures.json")
    assert status == 1, error
    assert error.count("\n") == 1, error
    assert "Traceback" not in error
    assert "unexpected" not in error, error
    assert out == ""
    for words in said:
        assert words in error
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
    status, _, error = fit(write_walk(folder))
    assert status == 1
    assert error.count("\n") == 1
    assert "walk.trc" in error


def test_spaces_and_accents_reach_the_data(folder):
    """The path opens; what fails is that no model knows three markers called so."""
    write_walk(folder, ("Épaule", "Café", "Où"))
    status, _, error = fit(folder)
    assert status == 1
    assert error.count("\n") == 1
    assert "marker" in error
    assert "unexpected" not in error
