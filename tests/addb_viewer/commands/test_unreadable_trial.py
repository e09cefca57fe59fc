"""A trial that cannot be read is left out of the fit, told on every way out, and the status says so."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from addb_viewer.app.subjects.library import open_library
from addb_viewer.commands.cli import app

NO_DYNAMICS = "[trajectory]\nenabled = false\n"


@pytest.fixture
def fitted(real_data, tmp_path):
    """A walk of opencap's subject 4, fitted beside a drop jump whose file is cut off inside a row."""
    markers = real_data / "opencap_subject4/MarkerData"
    shutil.copyfile(markers / "walking1.trc", tmp_path / "walk.trc")
    whole = (markers / "DJ1.trc").read_bytes()
    (tmp_path / "jump.trc").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "settings.toml").write_text(NO_DYNAMICS)
    return tmp_path, CliRunner().invoke(app, ["fit", str(tmp_path)])


def test_the_fit_is_kept_the_broken_trial_told_and_the_status_is_one(fitted):
    folder, done = fitted
    assert done.exit_code == 1
    assert "jump.trc: line" in done.stderr
    assert "fitted without 1 of 2 trials" in done.stderr
    figures = json.loads((folder / "results/fit.json").read_text())
    assert [trial["name"] for trial in figures["trials"]] == ["walk"]
    assert figures["unused"][0]["file"] == "jump.trc"
    left_out = "jump: left out, jump.trc cannot be used: line"
    assert any(note["text"].startswith(left_out) for note in figures["notes"])
    assert "1 file of the folder not used: jump.trc" in done.stdout
    notes = open_library(folder).notes
    assert any(note.startswith("Not used: jump.trc: line") for note in notes)

    again = CliRunner().invoke(app, ["fit", str(folder)])
    assert "unchanged: kept fit" in again.stdout
    assert again.exit_code == 1
    assert "fitted without 1 of 2 trials" in again.stderr
