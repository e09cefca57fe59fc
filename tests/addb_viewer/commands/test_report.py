"""`report` on the command line."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from solver.common.errors import CaptureError
from solver.common.notes import Kind, noted
from tests.addb_viewer.told_diagnosis import told


@pytest.fixture
def opening(command_line, monkeypatch):
    """Subjects are found by the names of their folders; `broken` is one that cannot be solved."""

    def opened(folder, awaits=False):
        if not folder.name.startswith(command_line.subject.folder.name):
            raise CaptureError(f"{folder}: no trials.")
        trials = tuple(
            replace(trial, markers=folder / trial.markers.relative_to(command_line.subject.folder))
            for trial in command_line.subject.trials
        )
        for trial in trials:
            trial.markers.parent.mkdir(parents=True, exist_ok=True)
            trial.markers.write_text("markers")
        return replace(command_line.subject, folder=folder, trials=trials)

    monkeypatch.setattr("solver.capture.subject.opened_subject.open_subject", opened)
    monkeypatch.setattr("addb_viewer.jobs.solving.open_subject", opened)
    return command_line


def test_a_page_beside_the_results_after_a_solve_that_was_due(opening):
    folder = opening.subject.folder
    done = opening("report", folder)
    assert done.exit_code == 0, done.output
    assert done.output.splitlines() == [str(folder / "results" / "report.html")]
    assert opening.solves == [None]
    page = (folder / "results" / "report.html").read_text(encoding="utf-8")
    assert "3 of 8 frames are usable" in page
    assert "Nobody has asked for a diagnosis" in page


def test_one_trial_of_a_current_fit_into_a_file_without_a_solve(opening, tmp_path):
    opening("fit", opening.subject.folder)
    done = opening("report", opening.subject.folder, "--out", tmp_path / "walk.html", "--trial", "walk")
    assert done.exit_code == 0, done.output
    assert len(opening.solves) == 1
    assert "3 of 4 frames are usable" in (tmp_path / "walk.html").read_text(encoding="utf-8")


def test_what_was_written_as_json(opening, tmp_path):
    folder, file = opening.subject.folder, tmp_path / "pages.json"
    assert opening("report", folder, "--json", file).exit_code == 0
    told = json.loads(file.read_text(encoding="utf-8"))
    (page,) = told["pages"]
    assert (page["subject"], page["file"]) == (folder.name, str(folder / "results" / "report.html"))
    assert sum(trial["usable_frames"] for trial in page["trials"]) == 3
    assert told["overview"] is None
    assert opening("report", folder, "--json", tmp_path / "missing" / "pages.json").exit_code == 2


def test_a_diagnosis_is_made_where_it_is_asked_for_and_none_is_kept(opening, monkeypatch):
    asked = []
    figures = {"verdict": "clean"}

    def diagnosis(subject, settings, *, trials, reviews, progress):
        asked.append(trials)
        return SimpleNamespace(notes=noted(Kind.OTHER, "looked at all"), trials=trials or ("walk",))

    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", diagnosis)
    monkeypatch.setattr("addb_viewer.jobs.diagnosing.report", lambda found, why=None: told(figures))
    folder, page = opening.subject.folder, opening.subject.folder / "results" / "report.html"
    assert opening("report", folder).exit_code == 0
    assert asked == []
    for _ in range(2):
        done = opening("report", folder, "--diagnose")
        assert done.exit_code == 0, done.output
        assert "No fault found in the recordings" in page.read_text(encoding="utf-8")
    assert asked == [None], "the second page shows the diagnosis that is kept"
    assert opening("report", folder).exit_code == 0
    assert "looked at all" in page.read_text(encoding="utf-8")


def test_a_folder_of_subjects_gives_an_overview_and_a_page_each(opening, tmp_path):
    name = opening.subject.folder.name
    root = tmp_path / "lab"
    for folder in (f"{name} 1", f"{name} 2", "notes"):
        (root / folder).mkdir(parents=True)
    done = opening("report", root)
    assert done.exit_code == 0, done.output
    files = [root / f"{name} {i}" / "results" / "report.html" for i in (1, 2)]
    assert done.output.splitlines() == [*map(str, files), str(root / "report.html")]
    page = (root / "report.html").read_text(encoding="utf-8")
    assert "%201/results/report.html" in page
    assert "notes is left out: notes: no trials." in page
    handed_over = opening("report", root, "--out", tmp_path / "pages")
    assert handed_over.exit_code == 0, handed_over.output
    assert {file.name for file in (tmp_path / "pages").iterdir()} == {
        "index.html",
        f"{name} 1.html",
        f"{name} 2.html",
    }


def test_a_subject_that_fails_is_told_and_the_others_have_their_page(opening, tmp_path):
    root = tmp_path / "lab"
    (root / f"{opening.subject.folder.name} 1").mkdir(parents=True)
    opening.failure = CaptureError(f"{root}/walk.trc: cut off")
    done = opening("report", root, "--json", tmp_path / "pages.json")
    assert done.exit_code == 1
    told = json.loads((tmp_path / "pages.json").read_text(encoding="utf-8"))
    assert (told["pages"][0]["file"], told["overview"]) == (None, str(root / "report.html"))
    assert "walk.trc: cut off" in told["pages"][0]["error"]
    assert "no report of 1 of 1 subjects" in done.stderr
    assert "no report: walk.trc: cut off" in (root / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "said"), [(("--trial", "wlak"), "walk"), (("--out", "missing/a.html"), "missing/a.html")]
)
def test_what_is_wrong_is_one_line(opening, options, said):
    done = opening("report", opening.subject.folder, *options)
    assert done.exit_code == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_no_such_folder(opening, tmp_path):
    done = opening("report", tmp_path / "nowhere")
    assert done.exit_code == 1
    assert "no such folder" in done.stderr


def test_a_page_replaces_no_recording(opening, tmp_path):
    recording = tmp_path / "walk.c3d"
    recording.write_text("measured")
    assert opening("report", opening.subject.folder, "--out", recording).exit_code == 2
    assert recording.read_text() == "measured"
