"""Bad input through the real command line: exit 1, one clear line, no traceback, nothing written.

What each reader refuses is tested beside it; here, that it comes out of the program so.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

MARKERS = ("RASI", "LASI", "SACR")
EXTERNAL_ENTITY = """<?xml version="1.0"?>
<!DOCTYPE m [<!ENTITY secret SYSTEM "file:///etc/hostname">]>
<OpenSimDocument Version="30000"><Model name="&secret;"></Model></OpenSimDocument>
"""


def trc() -> str:
    """Three markers that move 1 mm a frame at 100 Hz."""
    frames = 30
    names = "\t\t\t".join(MARKERS)
    axes = "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, 4))
    head = (
        "PathFileType\t4\t(X/Y/Z)\twalk.trc\n"
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
        f"100\t100\t{frames}\t3\tmm\t100\t1\t{frames}\n"
        f"Frame#\tTime\t{names}\t\t\n\t\t{axes}\n\n"
    )
    rows = [
        f"{i + 1}\t{i / 100:.2f}\t" + "\t".join(f"{100 * c + i:.3f}" for c in range(9)) for i in range(frames)
    ]
    return head + "\n".join(rows) + "\n"


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
    whole = trc()
    (folder / "walk.trc").write_text(whole[: whole.rindex("\t")])
    assert_refused(folder, "walk.trc", "line")


def test_a_model_that_asks_for_another_files_content(folder):
    (folder / "walk.trc").write_text(trc())
    (folder / "model.osim").write_text(EXTERNAL_ENTITY)
    (folder / "subject.toml").write_text('model = "model.osim"\n[trials.walk]\nmarkers = "walk.trc"\n')
    assert_refused(folder, "model.osim")


def test_a_folder_without_trials(folder):
    assert_refused(folder, folder.name, "trial")


def test_a_folder_that_is_a_file(folder):
    (folder / "walk.trc").write_text(trc())
    status, _, error = fit(folder / "walk.trc")
    assert status == 1
    assert error.count("\n") == 1
    assert "walk.trc" in error


def test_spaces_and_accents_reach_the_data(folder):
    """The path opens; what fails is that no model knows three markers called so."""
    (folder / "walk.trc").write_text(
        trc().replace("RASI", "Épaule").replace("LASI", "Café").replace("SACR", "Où")
    )
    status, _, error = fit(folder)
    assert status == 1
    assert error.count("\n") == 1
    assert "marker" in error
    assert "unexpected" not in error
