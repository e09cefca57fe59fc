"""`addb-viewer diagnose` as the app runs it."""

import json
import sys
import time

import numpy as np
import pytest

from addb_viewer.app import workers
from addb_viewer.app.jobs.job_queue import WorkerProcess
from addb_viewer.jobs.kept_diagnosis import kept
from solver.common.notes import Kind, noted
from solver.diagnosis.diagnosis import Diagnosis, Remaining
from solver.simulate.demo import write_demo_subject


@pytest.fixture
def subject(tmp_path):
    write_demo_subject(tmp_path / "S1", np.random.default_rng(1), trials=("static", "squat"))
    return tmp_path / "S1"


def test_it_keeps_the_answer_and_tells_progress(subject, monkeypatch, capsys):
    def finder(subject, settings, *, trials, reviews, progress):
        progress("screening", 0.5)
        return Diagnosis(
            "clean", (), (), {}, Remaining(9.0, 9.8), ("squat",), notes=noted(Kind.OTHER, "a note")
        )

    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", finder)
    monkeypatch.setattr(sys, "argv", ["worker", "diagnose", str(subject), str(subject / "elsewhere")])
    assert workers.main() == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line) == {"stage": "screening", "fraction": 0.5}
    figures, made_from = kept(subject / "elsewhere")
    assert figures["verdict"] == "clean"
    assert "a note" in [note["text"] for note in figures["notes"]]
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
