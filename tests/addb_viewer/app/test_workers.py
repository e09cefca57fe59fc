"""What the app's processes do: files, progress, and one clear line where they cannot."""

import json
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader

from addb_viewer.app import workers
from addb_viewer.app.jobs.job_queue import WorkerProcess
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange
from solver.common.notes import Kind, noted
from solver.diagnosis.diagnosis import Remaining
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.fitting.results.store import save_fit
from solver.simulate.demo_subject import write_demo_subject


@pytest.fixture
def subject(tmp_path):
    write_demo_subject(tmp_path / "S1", np.random.default_rng(1), trials=("static", "squat"))
    return tmp_path / "S1"


def test_it_keeps_the_answer_and_tells_progress(subject, monkeypatch, capsys):
    def finder(subject, settings, *, trials, reviews, progress):
        progress("screening", 0.5)
        return DiagnosisReport(
            "clean", (), (), {}, Remaining(9.0, 9.8), ("squat",), notes=noted(Kind.OTHER, "a note")
        )

    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", finder)
    monkeypatch.setattr(sys, "argv", ["worker", "diagnose", str(subject), str(subject / "elsewhere")])
    assert workers.main() == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line) == {"stage": "screening", "fraction": 0.5}
    figures, made_from = kept(subject / "elsewhere")
    assert figures.verdict == "clean"
    assert "a note" in figures.notes
    assert any(name.startswith("sha256") for name in made_from["provenance"])


@pytest.mark.slow
def test_a_recording_without_forces_fails_with_its_cause(subject):
    """The real process on real files."""
    (subject / "trials" / "squat" / "grf.mot").unlink()
    outcomes = []
    work = WorkerProcess(lambda *_: None, outcomes.append)
    work.start(("addb_viewer.app.workers", "diagnose", str(subject), str(subject / "results")))
    while work.running or not outcomes:
        time.sleep(0.1)
    assert not outcomes[0].succeeded
    assert "no trial has forces" in outcomes[0].error
    assert kept(subject / "results") is None


@pytest.fixture
def results(small_fit):
    folder = small_fit.subject.folder / "results"
    save_fit(small_fit, folder)
    return folder


@pytest.fixture
def record(monkeypatch, capsys):
    """Runs the work in this process: status, what it printed, its errors."""
    monkeypatch.setattr(workers, "end_in_order", lambda: None)

    def recorded(*arguments):
        monkeypatch.setattr(sys, "argv", ["worker", "record", *map(str, arguments)])
        return workers.main(), *capsys.readouterr()

    return recorded


def mcap_topics(file):
    with file.open("rb") as stream:
        channels = make_reader(stream).get_summary().channels.values()
    return {channel.topic for channel in channels}


def test_both_kinds_of_files_with_progress_between(small_fit, results, record):
    folder = small_fit.subject.folder
    with open_log(folder) as log:
        log.append("walk", FlagRange(1, 2, "manualReview"), "Zoë")
    files = [results / "recordings" / f"all{kind}" for kind in (".rrd", ".mcap")]
    status, out, error = record(folder, results, results, *files)
    assert status == 0, error
    lines = out.splitlines()
    shares = [json.loads(line)["fraction"] for line in lines if line.startswith("{")]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert [line for line in lines if not line.startswith("{")] == [str(file) for file in files]
    assert files[0].read_bytes()[:3] == b"RRF"
    assert {"/walk/residual", "/no%2fforces/markers", "/review/edits"} <= mcap_topics(files[1])


def test_one_trial_beside_another_fit(small_fit, results, tmp_path, record):
    other = tmp_path / "solve 2"
    save_fit(replace(small_fit, mass_kg=90.0), other)
    file = tmp_path / "walk.mcap"
    status, _, error = record(
        small_fit.subject.folder, results, other, file, "--previous", results, "--trial", "walk"
    )
    assert status == 0, error
    assert not any(topic.startswith("/no") for topic in mcap_topics(file))
    with file.open("rb") as stream:
        messages = make_reader(stream).iter_messages(topics=["/walk/residual"])
        before = [json.loads(message.data)["before_force_norm_N"] for _, _, message in messages]
    assert any(value is not None for value in before)


def test_a_report_says_what_the_command_line_s_says_of_the_fit_that_is_shown(
    small_fit, results, tmp_path, record
):
    other = tmp_path / "solve 2"
    save_fit(replace(small_fit, mass_kg=90.0), other)
    file = tmp_path / "new" / "walk.html"
    status, _, error = record(
        small_fit.subject.folder, results, other, file, "--previous", results, "--trial", "walk"
    )
    assert status == 0, error
    page = file.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert "90.0 kg fitted" in page
    assert "3 of 4 frames are usable" in page
    assert "Nobody has asked for a diagnosis" in page


def test_without_a_fit_it_says_so_and_writes_nothing(small_fit, tmp_path, record):
    file = tmp_path / "walk.mcap"
    status, _, error = record(small_fit.subject.folder, tmp_path / "results", tmp_path / "results", file)
    assert status == 1
    assert "fit.json" in error.splitlines()[-1]
    assert not file.exists()
