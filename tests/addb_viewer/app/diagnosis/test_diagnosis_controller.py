"""The Diagnosis tab without a browser: what is kept is shown, and decisions need a name."""

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.app.subjects import shared_subject
from addb_viewer.jobs.accepted_extension import keep_gain
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.results import extension_log
from tests.addb_viewer.commands.test_accept import GAIN
from tests.addb_viewer.fit_figures import of_trial
from tests.patience import FOR_EVER_S


@pytest.fixture
def accepted():
    """Writes a decision and what it gains."""

    def write(results):
        late = Cause("clock_offset", "all", {"offset_s": (0.012, 0.001)})
        decision = extension_log.accept(
            results, Extension((late,), np.ones(1), np.zeros(1)), by="Zoë", made_from={}
        )
        keep_gain(GAIN, decision, results)

    return write


@pytest.fixture
def app(tmp_path, make_replay, make_app, effect, figures):
    (tmp_path / "results").mkdir()
    kept = figures(effect("clock_offset", "all", offset_s=0.0123))
    made_from = {"provenance": {}, "settings": {}}
    (tmp_path / "results" / "diagnosis.json").write_text(
        json.dumps({**kept.as_json(), "made_from": made_from})
    )
    app = make_app(tmp_path, [make_replay(), make_replay("run")], login="Zoë")
    yield app
    app.close()


@pytest.fixture
def browser(app, enter):
    return enter(app)


def say(browser, said):
    """A word of the page's own about a cause, on a loop as where the channel hears it."""

    async def hear():
        browser.session.channel.take("cause", said)

    with ThreadPoolExecutor(1) as hearing:  # this thread's loop may be a browser's
        hearing.submit(asyncio.run, hear()).result()


def test_a_kept_diagnosis_is_there_when_the_app_opens(browser):
    panel = browser.session.diagnosis.panel
    browser.until(lambda: "Explained" in browser.html() and "named cause" in browser.html())
    assert not panel.diagnose.visible  # the page's own button diagnoses again
    assert not panel.accept.disabled
    told = browser.session.channel.shown("diagnosis")
    assert [card["title"] for card in told["cards"]] == ["forces shifted in time against the markers"]
    assert len(browser.session.scene.causes.one_by_one) == 1


def test_the_picture_is_that_of_the_trial_on_the_screen(browser):
    def picture():
        return browser.session.channel.shown("diagnosis-picture")

    assert picture()["trial"] == "walk"
    browser.open_trial("run")
    browser.until(lambda: picture() is None)  # it was not diagnosed
    browser.open_trial("walk")
    browser.until(lambda: picture() is not None)


def test_frames_of_a_cause_are_flagged_by_one_button_and_undone_by_u(app, browser, effect, figures):
    step = effect("off_plate_step", "calcn_r", ((120, 140),))
    kept = figures(step, effect("clock_offset", "all", offset_s=0.01))
    made_from = {"provenance": {}, "settings": {}}
    results = browser.session.shared.results
    (results / "diagnosis.json").write_text(json.dumps({**kept.as_json(), "made_from": made_from}))
    browser.session.diagnosis.show()

    def cards():
        return browser.session.channel.shown("diagnosis")["cards"]

    first, second = cards()
    assert first["flags"] == ["walk 120–139, right foot: not over a plate"]
    assert second["flags"] == []  # it acts all the time
    assert not first["flagged"]
    say(browser, ["flag", first["key"]])
    browser.until(lambda: cards()[0]["flagged"])
    (flag,) = browser.session.shared.reviews.review("walk").flags
    assert (flag.start, flag.end, flag.foot) == (120, 140, "calcn_r")
    assert (flag.reason, flag.author) == ("notOverForcePlate", "Zoë")
    browser.press("Undo")
    browser.until(lambda: not cards()[0]["flagged"])


def test_one_cause_is_decided_by_the_commands_own_words(browser, monkeypatch):
    asked = []
    monkeypatch.setattr(browser.session.shared, "_start", asked.append)
    for does in ("accept", "reject"):
        say(browser, [does, "clock_offset all"])
        browser.until(lambda: asked)
        task = asked.pop()
        assert task.command[1:3] == (does, "--cause=clock_offset:all")
        assert task.command[-2:] == ("--author", "Zoë")


@pytest.mark.parametrize(("key", "does"), [("Accept", "accept"), ("Reject", "reject")])
def test_after_x_a_key_decides_about_the_cause_where_no_proposal_is_at_hand(browser, monkeypatch, key, does):
    asked = []
    monkeypatch.setattr(browser.session.shared, "_start", asked.append)
    monkeypatch.setattr(
        browser.session.diagnosis, "state", replace(browser.session.diagnosis.state, changed=())
    )
    fitted = of_trial(name="walk", frames_used_ranges=((20, 180),))
    monkeypatch.setattr(type(browser.session.shared.fits.shown), "figures", lambda *_: fitted)
    browser.press(f"{key} the proposal")
    browser.until(lambda: browser.told("no open proposal here"))
    assert not asked, "nobody has looked at the cause"
    browser.press("Diagnose, or show the diagnosis")
    browser.until(lambda: "cause: forces shifted" in browser.html())
    browser.press(f"{key} the proposal")
    browser.until(lambda: asked)
    assert asked[0].command[1:3] == (does, "--cause=clock_offset:all")


@pytest.mark.parametrize(
    "said", [None, "accept", ["accept"], ["accept", 1], ["solve", "clock_offset all"], ["accept", "drag all"]]
)
def test_what_the_page_does_not_have_on_its_cards_does_nothing(browser, monkeypatch, said):
    asked = []
    monkeypatch.setattr(browser.session.shared, "_start", asked.append)
    say(browser, said)
    say(browser, ["reject", "clock_offset all"])  # after it
    browser.until(lambda: asked)
    assert [task.command[1] for task in asked] == ["reject"]


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
    monkeypatch.setattr(shared_subject, "DIAGNOSE_WORKER", ("sleeper",))
    other = enter(app, name="Bo")
    browser.press("Diagnose anew")
    other.until(lambda: "Diagnosing for Zoë" in other.html())
    other.press("Diagnose anew")
    other.until(lambda: other.told("It waits its turn"))
    browser.until(lambda: "then Diagnosing for Bo" in browser.html())
    other.press("Diagnose anew")
    other.until(lambda: other.told("Diagnosing waits its turn already"))
    other.press("Cancel what is at work")  # first one's own
    browser.until(lambda: "then Diagnosing for Bo" not in browser.html())
    other.press("Cancel what is at work")
    other.until(lambda: other.asked("Cancel what Zoë has asked for?"))
    assert browser.session.shared.jobs.process.running
    other.press("Yes, to the question")
    browser.until(lambda: browser.told("Bo has cancelled what you asked for"))
    browser.until(lambda: "nothing was written" in browser.html())
    browser.until(lambda: not browser.bar["work"])
