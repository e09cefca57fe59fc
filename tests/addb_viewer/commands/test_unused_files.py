"""What `fit` and the app say of files that are not used: on a real folder whose forces were left lying."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from addb_viewer.app.subjects.library import open_library
from addb_viewer.commands.cli import app

FILES = {
    "walk.trc": "opencap_subject4/MarkerData/walking1.trc",
    "walk_grf.mot": "opencap_subject4/ForceData/walking1_grf.mot",
    "jump plates.mot": "opencap_subject4/ForceData/DJ1_grf.mot",
    "walk_ik.mot": "opencap_subject4/reference/walking1_ik.mot",
}


@pytest.fixture
def folder(real_data, tmp_path):
    place = tmp_path / "Zoë"
    place.mkdir()
    for name, source in FILES.items():
        shutil.copyfile(real_data / source, place / name)
    (place / "notes.xlsx").write_text("x")
    (place / "settings.toml").write_text("[trajectory]\nenabled = false\n")
    return place


def test_fit_counts_them_names_the_worst_and_lists_all_when_asked(folder):
    run = CliRunner().invoke(app, ["fit", str(folder)])
    assert run.exit_code == 0, run.output
    (line,) = [line for line in run.stdout.splitlines() if "not used" in line]
    assert (
        line == "3 files of the folder not used: jump plates.mot, walk_ik.mot, notes.xlsx; --notes says why"
    )
    kept = json.loads((folder / "results" / "fit.json").read_text(encoding="utf-8"))["unused"]
    assert [file["file"] for file in kept] == ["jump plates.mot", "walk_ik.mot", "notes.xlsx"]
    assert all(file["reason"] for file in kept)

    (folder / "found later.csv").write_text("x")  # the kept fit stands; what is said is of now
    again = CliRunner().invoke(app, ["fit", str(folder), "--notes"])
    assert "unchanged: kept fit" in again.stdout
    assert "4 files of the folder not used:\n" in again.stdout
    assert "  walk_ik.mot: no columns of ground forces" in again.stdout
    assert "  found later.csv: text of a kind that is not read here" in again.stdout

    told = [note for note in open_library(folder).notes if note.startswith("Not used: ")]
    assert [note.split(": ")[1] for note in told] == [
        "jump plates.mot",
        "walk_ik.mot",
        "found later.csv",
        "notes.xlsx",
    ]
