"""The Diagnosis tab without a browser: what is kept is shown, and decisions need a name."""

import json

import numpy as np
import pytest

from addb_viewer.accepted_extension import keep_gain
from addb_viewer.app.subjects import shared_subject
from solver.dynamics.extension import Cause, Extension
from solver.results import extension_log
from tests.addb_viewer.commands.test_accept import GAIN
from tests.patience import FOR_EVER_S


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
def app(tmp_path, make_replay, make_app, effect, figures):
    (tmp_path / "results").mkdir()
    kept = figures(effect("clock_offset", "all", offset_s=0.0123))
    made_of = {"provenance": {}, "settings": {}}
    (tmp_path / "results" / "diagnosis.json").write_text(json.dumps({**kept, "made_of": made_of}))
    app = make_app(tmp_path, [make_replay(), make_replay("run")], login="Zoë")
    yield app
    app.close()


@pytest.fixture
def browser(app, enter):
    return enter(app)


def test_a_kept_diagnosis_is_there_when_the_app_opens(browser):
    panel = browser.session.diagnosis.panel
    browser.until(lambda: "Explained" in browser.html() and "named cause" in browser.html())
    assert panel.diagnose.label == "Diagnose again"
    assert not panel.accept.disabled
    assert len(browser.session.scene.causes.one_by_one) == 1


def test_the_residual_over_time_is_that_of_the_trial_on_the_screen(browser):
    panel = browser.session.diagnosis.panel
    assert panel.over_time.visible
    browser.until(lambda: "with causes" in browser.html())
    browser.put("Trial", "run")
    browser.until(lambda: not panel.over_time.visible)
    browser.put("Trial", "walk")
    browser.until(lambda: panel.over_time.visible)


def test_what_accepting_gained_is_shown_with_the_decision(browser, accepted):
    tab = browser.session.diagnosis
    assert not tab.panel.gain.visible
    accepted(browser.session.shared.results)
    tab.show()
    assert tab.panel.gain.visible
    browser.until(lambda: "right hip flexion by 12.3" in browser.html())


def test_a_torn_diagnosis_is_told_and_the_app_goes_on(browser):
    (browser.session.shared.results / "diagnosis.json").write_text("{")
    browser.session.diagnosis.show()
    browser.session.explain()
    browser.until(lambda: browser.told("Reading the diagnosis failed"))
    browser.until(lambda: browser.told("diagnosis.json"))
    assert browser.session.diagnosis.panel.accept.disabled
    assert browser.session.scene.causes.one_by_one == []


def test_nobody_decides_without_a_name(app, enter):
    browser = enter(app, name=None)
    browser.press("Accept the named causes")
    browser.until(lambda: browser.asked("Who is reviewing?"))
    assert not browser.session.shared.jobs.process.running


def test_one_thing_at_a_time_and_everybody_sees_it(app, browser, enter, monkeypatch):
    folder = browser.session.shared.subject.folder
    (folder / "sleeper.py").write_text(f"import time; time.sleep({FOR_EVER_S})")
    monkeypatch.setenv("PYTHONPATH", str(folder))
    monkeypatch.setattr(shared_subject, "DIAGNOSE_WORKER", "sleeper")
    other = enter(app, name="Bo")
    browser.press("Diagnose")
    other.until(lambda: "s so far" in other.html())
    other.until(lambda: "for Zoë" in other.html())
    other.press("Diagnose")
    other.until(lambda: other.told("It waits its turn"))
    browser.until(lambda: "then: Diagnosing for Bo" in browser.html())
    other.press("Diagnose")
    other.until(lambda: other.told("Diagnosing waits its turn already"))
    other.press("Cancel what is at work")  # first one's own
    browser.until(lambda: "then: Diagnosing for Bo" not in browser.html())
    other.press("Cancel what is at work")
    other.until(lambda: other.asked("Cancel what Zoë has asked for?"))
    assert browser.session.shared.jobs.process.running
    other.press("Yes, to the question")
    browser.until(lambda: browser.told("Bo has cancelled what you asked for"))
    browser.until(lambda: "nothing was written" in browser.html())
    browser.until(lambda: not browser.session.diagnosis.panel.cancel.visible)
