"""The Diagnosis panel in a real browser, with commands of our own making behind its buttons."""

import json
import textwrap
import time

import numpy as np
import pytest

from addb_viewer.app import diagnosis_desk
from addb_viewer.app.app import ReviewApp
from addb_viewer.app.server import open_server
from solver.dynamics.extension import Cause, Extension
from solver.results import extension_log

pytestmark = pytest.mark.browser

SPITEFUL = "<img src=x onerror='window.hacked=1'>"
WORKER = """
    import shutil, sys, time
    from pathlib import Path
    from addb_viewer.app.work import progress_line
    folder, results = map(Path, sys.argv[1:])
    print(progress_line("screening", 0.4), flush=True)
    if (folder / "slow").exists():
        time.sleep(600)
    if (folder / "broken").exists():
        sys.exit("addb-viewer: walk.mot: line 7 is cut off")
    results.mkdir(exist_ok=True)
    shutil.copy(folder / "answer.json", results / "diagnosis.json")
"""


@pytest.fixture(scope="module")
def app(tmp_path_factory, make_replay, make_library, effect, figures):
    folder = tmp_path_factory.mktemp("subject")
    told = figures(
        effect("clock_offset", "all", offset_s=0.0123),
        effect(
            "external_contact", "pelvis", ((120, 140), (170, 180)),
            force_x_N=0.0, force_y_N=60.0, force_z_N=0.0,
        ),
        effect("marker_slip", SPITEFUL, shift_m=0.02),
        alternatives=[
            {
                "id": "sample_rate", "target": "all", "instead_of": "clock_offset all",
                "why": "cosine 0.99", "separate_by": "a longer recording",
            }
        ],
    )  # fmt: skip
    (folder / "answer.json").write_text(
        json.dumps({**told, "made_of": {"provenance": {}, "settings": {}}}), encoding="utf-8"
    )
    (folder / "tested_worker.py").write_text(textwrap.dedent(WORKER))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnosis_desk, "WORKER", "tested_worker")
        patch.chdir(folder)  # `python -m` looks there first
        app = ReviewApp(open_server(port=0), make_library(folder, [make_replay()]))
        app.open_trial("walk")
        yield app
        app.close()


@pytest.fixture(scope="module")
def page(open_page, app):
    page = open_page(app)
    page.get_by_role("tab", name="Diagnosis").click()
    yield page
    assert page.evaluate("window.hacked") is None
    page.close()


@pytest.fixture(autouse=True)
def nothing_at_work(app, page, close_notices, until):
    for name in ("slow", "broken"):
        (app.library.subject.folder / name).unlink(missing_ok=True)
    close_notices(page)
    yield
    app.desk.work.cancel()
    until(lambda: not app.desk.work.running)
    assert page.errors == []


@pytest.fixture
def diagnosed(app, page, until):
    """With the diagnosis on the screen."""
    if app.desk.state.figures is None:
        page.get_by_role("button", name="Diagnose", exact=True).click()
    until(lambda: app.desk.state.figures is not None)
    page.get_by_text("1 · forces shifted in time against the markers").wait_for()


def test_diagnosing_shows_progress_and_cancel_ends_it(app, page, until):
    slow = app.library.subject.folder / "slow"
    slow.touch()
    page.get_by_text("Nobody has asked yet").wait_for()
    page.keyboard.press("x")
    page.get_by_text("screening").wait_for()
    page.get_by_text("so far").wait_for()
    page.keyboard.press(".")  # the page stays alive
    until(lambda: app.playback.position.frame == 1)
    page.get_by_role("button", name="Cancel").click()
    page.get_by_text("Diagnosing was cancelled; nothing was written.").wait_for()
    assert not (app.library.results / "diagnosis.json").exists()
    page.get_by_role("button", name="Diagnose", exact=True).wait_for()


def test_a_failure_is_a_notification_with_its_cause(app, page, close_notices):
    (app.library.subject.folder / "broken").touch()
    page.get_by_role("button", name="Diagnose", exact=True).click()
    page.get_by_text("Diagnosing failed", exact=True).wait_for()
    assert page.get_by_text("walk.mot: line 7 is cut off").count() >= 1
    close_notices(page)


def test_the_answer_is_on_the_page_and_in_the_scene(app, page, diagnosed, until):
    for text in (
        "Explained",
        "12 ± 2 ms too late",
        "a longer recording",
        "41 → 12 N",
        "towards +y",
        "Nobody has decided yet.",
    ):
        assert page.get_by_text(text).count() >= 1, text
    until(lambda: len(app.scene.causes.one_by_one) == 3)
    assert app.server.scene.get_handle_by_name("/lab/trial/causes/1/force") is not None


def test_a_click_on_frames_goes_there(app, page, diagnosed, until):
    page.get_by_role("button", name="170–179").click()
    until(lambda: app.playback.position.frame == 170)
    until(lambda: app.scene.causes.one_by_one[1].arrow.visible)
    app.playback.seek(150)
    until(lambda: not app.scene.causes.one_by_one[1].arrow.visible)


def test_the_residual_over_time_leads_to_its_worst_half_second(app, page, diagnosed, until):
    page.get_by_text("Residual over time: walk").wait_for()
    app.playback.seek(0)
    page.get_by_role("button", name="Worst half second").click()
    until(lambda: app.playback.position.frame == 120)


def test_named_causes_can_be_hidden(app, page, diagnosed, until):
    page.get_by_text("Named causes", exact=True).click()
    until(lambda: not app.scene.options.causes)
    until(lambda: not app.scene.causes.one_by_one[0].label.visible)
    page.get_by_text("Named causes", exact=True).click()
    until(lambda: app.scene.causes.one_by_one[0].label.visible)


def test_a_refused_decision_says_why(app, page, diagnosed, close_notices):
    """The real `accept`, on a folder without recordings."""
    page.get_by_role("button", name="Accept").click()
    page.get_by_text("Accepting failed", exact=True).wait_for()
    assert app.library.subject.folder.name in page.locator(".mantine-Notification-root").first.inner_text()
    close_notices(page)


def test_a_decision_is_echoed_with_its_author(app, page, diagnosed):
    late = Cause("clock_offset", "all", {"offset_s": (0.012, 0.001)})
    accepted = Extension((late,), np.ones(1), np.zeros(1))
    extension_log.accept(app.library.results, accepted, by="Zoë", made_of={})
    app.desk.show()
    page.get_by_text("Accepted by Zoë on").wait_for()
    time.sleep(0.5)
    assert page.get_by_text("The next fit uses it.").count() == 1
