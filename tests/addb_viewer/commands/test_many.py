"""One command on many subjects: what fails stops nothing, and what is done stays done."""

import csv
import json
import shutil
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.commands.many import Status, Work, done_to_all, options, several
from tests.patience import PATIENCE_S


def subject(folder):
    folder.mkdir(parents=True)
    (folder / "walk.trc").write_text("never read")
    (folder / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    return folder


@pytest.fixture
def root(tmp_path):
    """Three subjects, one of them two folders down; one that is broken; one that is none."""
    for name in ("anna", "ben", "more/carl"):
        subject(tmp_path / name)
    broken = subject(tmp_path / "dora")
    (broken / "subject.toml").write_text('mass_kg = "heavy\n')
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "laboratory.txt").write_text("no recording")
    return tmp_path


def trials(figures, _):
    return {"trials": len(figures["trials"])}


def test_a_folder_of_subjects_is_told_from_a_subject(root, tmp_path):
    assert several(root / "anna") is None
    assert several(root / "pictures") is None
    found = several(root)
    assert found is not None
    assert set(found.names) == {"anna", "ben", "more/carl"}


@pytest.mark.slow
def test_every_subject_has_its_line_and_its_figures_or_why_it_has_none(root):
    (root / "ben" / "annotations.sqlite").write_bytes(b"not a database at all" * 99)
    lines = []
    outcomes = done_to_all(several(root), Work("flags", (), None, trials), 2, lines.append)
    found = {o.subject: o for o in outcomes}
    assert {name: o.status for name, o in found.items()} == {
        "anna": Status.DONE,
        "ben": Status.FAILED,
        "more/carl": Status.DONE,
        "dora": Status.FAILED,
    }
    assert [dict(found[name].row) for name in ("anna", "more/carl")] == [{"trials": 1}] * 2
    assert "annotations.sqlite" in found["ben"].reason
    assert "Traceback" not in found["ben"].reason
    assert "subject.toml" in found["dora"].reason
    assert lines[0].startswith("note: pictures is left out: ")
    assert [line.split()[0] for line in lines[1:]] == ["1/3", "2/3", "3/3"]
    assert sorted(line.split()[1] for line in lines[1:]) == ["anna:", "ben:", "more/carl:"]


def test_each_subject_s_warnings_stand_below_its_line(root, monkeypatch):
    code = "import sys; print('fine\\n! mass not given' if 'ben' in sys.argv[2] else 'fine\\nalso noted: !')"
    monkeypatch.setattr("addb_viewer.jobs.processes.own_process", lambda _: [sys.executable, "-c", code])
    lines = []
    done_to_all(several(root), Work("fit", (), None, lambda *_: {}, has_json=False), 1, lines.append)
    (place,) = [k for k, line in enumerate(lines) if "  ben: " in line]
    assert lines[place + 1] == "    ! mass not given"
    assert sum("!" in line for line in lines) == 1


def test_what_is_kept_and_still_true_is_not_made_again(root):
    def kept(folder):
        return None if folder.name == "anna" else {"trials": []}

    outcomes = done_to_all(several(root), Work("flags", (), None, trials, kept=kept), 1, lambda _: None)
    assert [o.subject for o in outcomes if o.status is Status.KEPT] == ["ben", "more/carl"]


def test_options_are_typed_as_the_shell_has_them(tmp_path):
    assert options(trial=["a", "b"], map_=tmp_path, ignore_review=True, force=False, settings=None) == (
        "--trial", "a", "--trial", "b", "--map", str(tmp_path), "--ignore-review",
    )  # fmt: skip


@pytest.mark.parametrize("words", [("fit", "--csv"), ("ablation", "--figure"), ("diagnose", "--csv")])
def test_no_table_and_no_figure_replaces_a_recording(root, words):
    recording = root / "ben" / "walk.trc"
    run = CliRunner().invoke(app, [words[0], str(root / "anna"), words[1], str(recording)])
    assert run.exit_code == 2
    assert "Name another file" in run.stderr
    assert recording.read_text() == "never read"


@pytest.mark.parametrize(("option", "value"), [("--csv", "all.csv"), ("--jobs", "2")])
def test_one_subject_has_no_use_for_what_is_for_several(root, option, value):
    run = CliRunner().invoke(app, ["fit", str(root / "anna"), option, value])
    assert run.exit_code == 2
    assert option in run.stderr


@pytest.mark.slow
@pytest.mark.real
def test_a_killed_fit_of_many_goes_on_where_it_was(real_data, tmp_path):
    recording = real_data / "anomalies" / "UpsideDownData"
    root = tmp_path / "root"
    for name in ("a", "b", "cut"):
        shutil.copytree(recording, root / name, copy_function=shutil.copyfile)
    cut = root / "cut" / "trial2.c3d"
    cut.write_bytes(cut.read_bytes()[:3000])
    words = [sys.executable, "-m", "addb_viewer", "fit", str(root)]
    first = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert first.stdout is not None
    assert first.stdout.readline().startswith("1/3  a: done ")
    first.send_signal(signal.SIGTERM)
    printed, complained = first.communicate(timeout=PATIENCE_S)
    assert first.returncode == 130
    assert "what was finished is kept" in complained
    table, figures = tmp_path / "all.csv", tmp_path / "all.json"
    again = subprocess.run(
        [*words, "--csv", str(table), "--json", str(figures)], capture_output=True, text=True, check=False
    )
    assert again.returncode == 1
    with table.open(newline="") as file:
        rows = {row["subject"]: row for row in csv.DictReader(file)}
    assert (rows["a"]["status"], rows["cut"]["status"]) == ("kept", "failed")
    # The signal may come after b is written and before its line is printed: kept then, without a line.
    assert rows["b"]["status"] in (("kept",) if "b: done " in printed else ("kept", "done"))
    assert rows["a"]["marker RMS cm"] == rows["b"]["marker RMS cm"] != ""
    assert "trial2.c3d" in rows["cut"]["reason"]
    assert again.stderr.splitlines()[-1] == "addb-viewer: 1 of 3 subjects failed, see above"
    each = json.loads(figures.read_text(encoding="utf-8"))["subjects"]
    assert [found["figures"].get("trials", [{}])[0].get("frames") for found in each] == [48, 48, None]
