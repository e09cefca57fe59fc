"""The demo and the app, from the shell."""

import numpy as np
import pytest

from addb_viewer.jobs.demo import SEED
from solver.diagnosis.diagnose_subject import diagnose_subject
from solver.diagnosis.diagnosis import Remaining
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.simulate.demo_subject import LateForces, write_demo_subject


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
    clean = DiagnosisReport("clean", (), (), {}, Remaining(9.0, 9.8), ("walk",))
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


@pytest.fixture(scope="module")
def told_and_true(tmp_path_factory):
    """The diagnosis of the demo's walk, which is the same without the other trials, and the truth."""
    folder = tmp_path_factory.mktemp("demo") / "S1"
    rng = np.random.default_rng(SEED)
    truth = write_demo_subject(folder, rng, trials=("static", "walk"), cause=LateForces())
    return diagnose_subject(folder), truth


@pytest.mark.slow
def test_both_causes_are_named_and_no_other(told_and_true):
    told, truth = told_and_true
    ((foot, _, _),) = truth.off_plate["walk"]
    assert {(e["id"], e["target"]) for e in told["effects"]} == {
        ("off_plate_step", foot),
        ("clock_offset", "all"),
    }
    assert told["verdict"] == "explained"
    assert told["alternatives"] == []


@pytest.mark.slow
def test_the_delay_is_the_hidden_one(told_and_true):
    told, truth = told_and_true
    (late,) = (e for e in told["effects"] if e["id"] == "clock_offset")
    offset = late["parameters"]["offset_s"]
    assert offset["value"] == pytest.approx(truth.cause.offset_s, abs=max(2 * offset["std"], 0.001))
    assert offset["std"] < 0.001


@pytest.mark.slow
def test_the_step_is_where_it_was(told_and_true):
    told, truth = told_and_true
    (step,) = (e for e in told["effects"] if e["id"] == "off_plate_step")
    ((_, since, until),) = truth.off_plate["walk"]
    ((_, start, end),) = step["frames"]
    assert start / 100 == pytest.approx(since, abs=0.05)
    assert (end - 1) / 100 == pytest.approx(until, abs=0.05)


@pytest.mark.slow
def test_what_is_wrong_is_worst_during_the_step_while_no_plate_is_loaded(told_and_true):
    told, truth = told_and_true
    ((_, since, until),) = truth.off_plate["walk"]
    residual = told["residual"]
    (walk,) = residual["trials"]
    start, end = (frame / told["rates_Hz"]["walk"] for frame in walk["worst"]["frames"])
    assert since < (start + end) / 2 < until
    worst_phase = max(residual["phases"], key=lambda phase: phase["force_N"])
    assert worst_phase["phase"] == "no_load"
    assert max(residual["axes"], key=lambda axis: axis["force_N"])["direction"] == "vertical"
    time_history = walk["time_history"]
    assert np.mean(time_history["force_after_N"]) < np.mean(time_history["force_N"])


@pytest.mark.slow
def test_the_step_s_force_is_told_over_time(told_and_true):
    told, _ = told_and_true
    (step,) = (e for e in told["effects"] if e["id"] == "off_plate_step")
    (time_history,) = step["time_histories"]
    ((_, start, _),) = step["frames"]
    assert time_history["start"] == start
    vertical = np.array(time_history["force_N"])[:, 1]
    assert vertical.max() > 1.3 * step["parameters"]["force_y_N"]["value"]


@pytest.mark.slow
def test_what_the_fit_noted_is_not_lost(told_and_true):
    told, _ = told_and_true
    notes = [note["text"] for note in told["notes"]]
    assert any(note.startswith("walk: grf.mot: moment columns") for note in notes)
    assert any("no marker of the recordings shows" in note and "toes_r" in note for note in notes)
