"""The desk without a browser: what is kept is shown, and decisions need a name."""

import json
import time

import numpy as np
import pytest

from addb_viewer.accepted_extension import keep_gain
from addb_viewer.app import diagnosis_desk
from addb_viewer.app.app import ReviewApp
from addb_viewer.app.server import open_server
from solver.dynamics.extension import Cause, Extension
from solver.errors import SolverError
from solver.results import extension_log
from tests.addb_viewer.commands.test_accept import GAIN


@pytest.fixture
def accepted():
    """Writes a decision and what it gains."""

    def write(results):
        late = Cause("clock_offset", "all", {"offset_s": (0.012, 0.001)})
        decision = extension_log.accept(
            results, Extension((late,), np.ones(1), np.zeros(1)), by="Zoë", made_of={}
        )
        keep_gain(GAIN | {"causes": []}, decision, results)

    return write


@pytest.fixture
def app(tmp_path, make_replay, make_library, effect, figures):
    (tmp_path / "results").mkdir()
    kept = figures(effect("clock_offset", "all", offset_s=0.0123))
    made_of = {"provenance": {}, "settings": {}}
    (tmp_path / "results" / "diagnosis.json").write_text(json.dumps({**kept, "made_of": made_of}))
    app = ReviewApp(open_server(port=0), make_library(tmp_path, [make_replay()]))
    app.open_trial("walk")
    yield app
    app.close()


def test_a_kept_diagnosis_is_there_when_the_app_opens(app):
    panel = app.desk.panel
    assert "Explained" in panel.verdict.content
    assert panel.diagnose.label == "Diagnose again"
    assert not panel.accept.disabled
    assert len(app.scene.causes.one_by_one) == 1
    assert "named cause" in app.controls.legend.content


def test_the_residual_over_time_is_that_of_the_trial_on_the_screen(app, make_replay):
    panel = app.desk.panel
    assert panel.over_time.visible
    assert len(panel.charts.plots) == 2
    app.library.replays["run"] = make_replay("run")
    app.open_trial("run")
    assert not panel.over_time.visible
    assert panel.charts.plots == []
    app.open_trial("walk")
    assert panel.over_time.visible


def test_the_cursor_of_the_residual_follows(app, until):
    app.playback.seek(100)
    until(lambda: abs(app.desk.panel.charts.time - 3.0) < 1e-9)


def test_what_accepting_gained_is_shown_with_the_decision(app, accepted):
    assert not app.desk.panel.gain.visible
    accepted(app.library.results)
    app.desk.show()
    assert app.desk.panel.gain.visible
    assert "hip_flexion_r by 12.3" in app.desk.panel.gain.content


def test_a_torn_diagnosis_is_told_and_the_app_goes_on(app):
    (app.library.results / "diagnosis.json").write_text("{")
    app.desk.show()
    ((title, body),) = app.notices.waiting
    assert title == "Reading the diagnosis failed"
    assert "diagnosis.json" in body
    assert app.desk.panel.accept.disabled
    assert app.scene.causes.one_by_one == []


def test_nobody_decides_without_a_name(app):
    app.desk.panel.author.value = " "
    with pytest.raises(SolverError, match="Decided by"):
        app.desk.accept()
    assert not app.desk.work.running


def test_one_thing_at_a_time(app, monkeypatch):
    (app.library.subject.folder / "sleeper.py").write_text("import time; time.sleep(60)")
    monkeypatch.chdir(app.library.subject.folder)
    monkeypatch.setattr(diagnosis_desk, "WORKER", "sleeper")
    app.desk.diagnose()
    assert app.desk.panel.cancel.visible
    with pytest.raises(SolverError, match="Diagnosing is at work"):
        app.desk.fit()
    app.desk.work.cancel()
    end = time.monotonic() + 10
    while app.desk.panel.cancel.visible and time.monotonic() < end:
        time.sleep(0.02)
    assert not app.desk.panel.cancel.visible
    assert "nothing was written" in app.desk.panel.status.content
