"""Another package named `solver` or `annotations` before ours: a sentence, not an error deep inside."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from addb_viewer.jobs.environment import NAMES, own_process


def ran(folder, *words, env=None):
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=env)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("as_file", ["{}.py", "{}/__init__.py"])
def test_a_stranger_in_the_working_folder_is_named(name, as_file, tmp_path):
    stranger = tmp_path / as_file.format(name)
    stranger.parent.mkdir(exist_ok=True)
    stranger.write_text("")
    told = ran(tmp_path, "-m", "addb_viewer", "--version").stderr.splitlines()[-1]
    assert f"needs its own package '{name}'" in told
    assert os.fspath(stranger.parent if stranger.name == "__init__.py" else stranger) in told
    assert "Rename or uninstall" in told


def test_a_folder_that_is_no_package_is_no_stranger(tmp_path):
    for name in NAMES:
        (tmp_path / name).mkdir()
    ours = os.fspath(Path(__file__).parents[3])
    told = ran(tmp_path, "-m", "addb_viewer", "--version", env={**os.environ, "PYTHONPATH": ours})
    assert told.returncode == 0, told.stderr


def test_a_process_of_ours_imports_nothing_from_a_recordings_folder(tmp_path, monkeypatch):
    (tmp_path / "numpy.py").write_text("raise SystemExit('a stranger ran')")
    monkeypatch.chdir(tmp_path)
    fit = ("addb_viewer", "fit", ".")
    assert "a stranger ran" in ran(tmp_path, "-m", *fit).stderr
    told = ran(tmp_path, *own_process(fit[0])[1:], *fit[1:])
    assert "a stranger ran" not in told.stderr
    assert told.stderr.startswith("addb-viewer: ")
