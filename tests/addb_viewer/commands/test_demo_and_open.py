"""`addb-viewer demo` and `open`: what they hand to the app, and which folders they leave alone."""

import pytest

from solver.diagnosis.diagnosis import Diagnosis, Remaining
from solver.simulate.demo import LateForces


@pytest.fixture
def served(monkeypatch):
    """What reached the app: (folder, host, port)."""
    calls = []
    monkeypatch.setattr("addb_viewer.commands.open.serve_app", lambda *call: calls.append(call))
    return calls


@pytest.fixture
def made(monkeypatch):
    """Folders that a demo subject was written into, with what draws it and what is hidden in it."""
    folders = []

    def write_demo_subject(folder, rng, cause, trials):
        folders.append((folder, rng.integers(1000), cause))
        (folder / "subject.toml").write_text("")

    monkeypatch.setattr("addb_viewer.jobs.demo.write_demo_subject", write_demo_subject)
    clean = Diagnosis("clean", (), (), {}, Remaining(9.0, 9.8), ("walk",))
    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", lambda *_, **__: clean)
    return folders


def test_open_hands_the_folder_to_the_app_on_this_machine_only(command_line, served):
    folder = command_line.subject.folder
    assert command_line("open", folder).exit_code == 0
    assert command_line("open", folder, "--host", "::1", "--port", "0", "--out", folder / "b").exit_code == 0
    assert served == [(folder, "127.0.0.1", 8080, None), (folder, "::1", 0, folder / "b")]


def test_open_refuses_a_folder_that_is_not_there(command_line, served, tmp_path):
    run = command_line("open", tmp_path / "nobody")
    assert run.exit_code == 1
    assert "nobody: no such folder" in run.stderr
    assert served == []


def test_demo_makes_fits_diagnoses_and_opens(command_line, served, made, tmp_path):
    folder = tmp_path / "demo"
    run = command_line("demo", "--folder", folder, "--port", "9000")
    assert run.exit_code == 0
    assert "marker RMS" in run.stdout
    assert run.stdout.index("marker RMS") < run.stdout.index("VERDICT")
    assert (folder / "results" / "fit.json").is_file()
    assert (folder / "results" / "diagnosis.json").is_file()
    assert made[0][2] == LateForces()
    assert served == [(folder, "127.0.0.1", 9000)]


def test_demo_without_serving_ends_after_the_diagnosis(command_line, served, made, tmp_path):
    assert command_line("demo", "--folder", tmp_path / "demo", "--no-serve").exit_code == 0
    assert served == []
    assert len(command_line.solves) == 1


def test_the_demo_is_the_same_every_time_and_may_replace_itself(command_line, served, made, tmp_path):
    for _ in range(2):
        assert command_line("demo", "--folder", tmp_path / "demo", "--no-serve").exit_code == 0
    assert made[0] == made[1]


def test_the_demo_writes_over_nobody_elses_folder(command_line, served, made, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "thesis.txt").write_text("years of work")
    run = command_line("demo", "--folder", folder)
    assert run.exit_code == 1
    assert "mine: not empty and not the demo's; choose another folder with --folder" in run.stderr
    assert [path.name for path in folder.iterdir()] == ["thesis.txt"]
    assert made == []
