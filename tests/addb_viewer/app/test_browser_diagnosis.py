"""The Diagnosis panel in a real browser, with commands of our own making behind its buttons."""

import json
import os
import textwrap

import numpy as np
import pytest

from addb_viewer.app.subjects import shared_subject
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.results import extension_log
from tests.patience import FOR_EVER_S

pytestmark = pytest.mark.browser

SPITEFUL = "<img src=x onerror='window.hacked=1'>"
WORKER = """
    import shutil, sys, time
    from pathlib import Path
    from addb_viewer.jobs.processes import print_progress
    folder, results = map(Path, sys.argv[1:])
    print_progress("screening", 0.4)
    if (folder / "slow").exists():
        time.sleep(FOR_EVER_S)
    if (folder / "broken").exists():
        sys.exit("addb-viewer: walk.mot: line 7 is cut off")
    results.mkdir(exist_ok=True)
    shutil.copy(folder / "answer.json", results / "diagnosis.json")
"""


@pytest.fixture(scope="module")
def app(tmp_path_factory, make_replay, make_app, effect, figures):
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
        json.dumps({**told.as_json(), "made_from": {"provenance": {}, "settings": {}}}), encoding="utf-8"
    )
    (folder / "tested_worker.py").write_text(textwrap.dedent(WORKER).replace("FOR_EVER_S", str(FOR_EVER_S)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shared_subject, "DIAGNOSE_WORKER", ("tested_worker",))
        patch.setenv("PYTHONPATH", str(folder), prepend=os.pathsep)
        patch.chdir(folder)
        app = make_app(folder, [make_replay()], login="Zoë")
        yield app
        app.close()


@pytest.fixture(scope="module")
def folder(app):
    return app.subjects.loaded[0].subject.folder


@pytest.fixture(scope="module")
def page(open_page, app):
    page = open_page(app)
    page.get_by_role("tab", name="Diagnosis").click()
    yield page
    assert page.evaluate("window.hacked") is None
    page.close()


@pytest.fixture(autouse=True)
def nothing_at_work(page, folder, until):
    for name in ("slow", "broken"):
        (folder / name).unlink(missing_ok=True)
    yield
    page.session.shared.jobs.cancel()
    until(lambda: not page.session.shared.jobs.process.running)
    assert page.errors == []


@pytest.fixture
def diagnosed(page, until):
    """With the diagnosis on the screen."""
    if page.session.diagnosis.state.figures is None:
        page.get_by_role("button", name="Diagnose", exact=True).click()
    until(lambda: page.session.diagnosis.state.figures is not None)
    page.get_by_role("article", name="cause 1, forces shifted in time against the markers").wait_for()


def test_diagnosing_shows_progress_and_cancel_ends_it(page, folder, until):
    slow = folder / "slow"
    slow.touch()
    page.get_by_text("No diagnosis yet").wait_for()
    page.keyboard.press("x")
    page.locator("#addb-work").get_by_text("⟳ 40 %").wait_for()  # on every tab, and in the browser's title
    until(lambda: page.title().startswith("40 % Diagnosing"))
    page.keyboard.press(".")  # the page stays alive
    until(lambda: page.session.playback.position.frame == 1)
    page.locator("#addb-work").click()
    page.get_by_text("screening").wait_for()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_text("Diagnosing was cancelled; nothing was written.").wait_for()
    assert not (page.session.shared.results / "diagnosis.json").exists()
    page.get_by_role("button", name="Diagnose", exact=True).wait_for()


def test_a_failure_is_a_notification_with_its_cause(page, folder):
    (folder / "broken").touch()
    page.get_by_role("button", name="Diagnose", exact=True).click()
    page.locator("#addb-notice").get_by_text("Diagnosing failed", exact=True).wait_for()
    page.get_by_text("walk.mot: line 7 is cut off").first.wait_for(state="attached")


def test_the_answer_is_on_the_page_and_in_the_scene(page, folder, diagnosed, until):
    for text in (
        "Explained",
        "12 ± 2 ms too late",
        "a longer recording",
        "41 → 12 N",
        "upwards",
        "Nobody has decided yet.",
    ):
        page.get_by_text(text).first.wait_for(state="attached")
    page.locator("#addb-diagnosis").get_by_text(SPITEFUL).first.wait_for()
    until(lambda: len(page.session.scene.causes.one_by_one) == 3)
    assert page.session.client.scene.get_handle_by_name("/lab/trial/causes/1/force") is not None


def test_a_click_on_frames_goes_there(page, folder, diagnosed, until):
    page.get_by_role("button", name="Go to cause 2").click()
    until(lambda: page.session.playback.position.frame == 120)
    until(lambda: page.session.scene.causes.one_by_one[1].arrow.visible)
    page.session.playback.seek(150)
    until(lambda: not page.session.scene.causes.one_by_one[1].arrow.visible)


def test_verdict_two_cards_and_the_picture_are_on_one_screen(page, folder, diagnosed, until):
    """In the panel of a page of 1280 × 720, nothing scrolled; the picture leads to its frames."""
    size = page.viewport_size
    page.set_viewport_size({"width": 1280, "height": 720})
    strip = page.locator("#addb-strip").bounding_box()["y"]
    cards = page.locator("#addb-diagnosis article")
    third = cards.nth(2).bounding_box()
    cards.nth(2).evaluate("card => card.remove()")  # there are three
    drawing = page.locator("#addb-before-after svg").last
    until(lambda: (box := drawing.bounding_box()) and box["y"] + box["height"] <= strip)
    assert third["height"] < 100
    panel = page.locator("#addb-diagnosis")
    assert panel.evaluate("of => of.scrollWidth <= of.clientWidth")
    page.session.playback.seek(0)
    box = drawing.bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
    until(lambda: abs(page.session.playback.position.frame - 100) <= 1)
    page.get_by_role("button", name="Worst half second").click()
    until(lambda: page.session.playback.position.frame == 120)
    page.set_viewport_size(size)


def test_the_pictures_cursor_goes_with_the_timelines_ahead_of_the_server(page, folder, diagnosed, until):
    def frames():
        """By the picture, and by the timeline."""
        return page.evaluate("""() => {
            const cursor = document.querySelector("#addb-before-after .cursor");
            return [cursor.getAttribute("x1") / cursor.ownerSVGElement.viewBox.baseVal.width,
                    parseFloat(document.getElementById("addb-cursor").style.left) / 100];
        }""")

    page.keyboard.press("Home")
    until(lambda: page.session.frame == 0 and frames() == [0, 0])
    page.evaluate("window.toServer = window.addb.send; window.addb.send = () => {};")
    page.keyboard.press(".")
    drawn, timeline = frames()
    assert drawn == pytest.approx(timeline, abs=1e-3)
    assert drawn > 0
    assert page.session.frame == 0
    page.evaluate("window.addb.send = window.toServer;")
    until(lambda: frames() == [0, 0], "the server's frame, where it does not come along")


def test_a_button_flags_the_frames_of_a_cause(page, folder, diagnosed, until):
    page.get_by_role("button", name="Flag these 2 ranges: cause 2").click()
    until(lambda: len(page.session.shared.reviews.review("walk").flags) == 2)
    page.get_by_text("✓ Flagged").wait_for()


def test_named_causes_can_be_hidden(page, folder, diagnosed, until):
    page.get_by_role("tab", name="View", exact=True).click()
    page.get_by_text("Named causes", exact=True).click()
    until(lambda: not page.session.scene.options.causes)
    until(lambda: not page.session.scene.causes.one_by_one[0].label.handle.visible)
    page.get_by_text("Named causes", exact=True).click()
    until(lambda: page.session.scene.causes.one_by_one[0].label.handle.visible)


@pytest.mark.slow
def test_a_refused_decision_says_why(page, folder, diagnosed):
    """The real `accept`, on a folder without recordings."""
    page.get_by_role("tab", name="Diagnosis").click()
    page.get_by_role("button", name="Accept cause 1").click()
    page.get_by_text("Accepting failed", exact=True).wait_for()
    assert folder.name in page.locator("#addb-notice").inner_text()


def test_a_decision_is_echoed_with_its_author(page, folder, diagnosed):
    late = Cause("clock_offset", "all", {"offset_s": (0.012, 0.001)})
    accepted = Extension((late,), np.ones(1), np.zeros(1))
    extension_log.accept(page.session.shared.results, accepted, by="Zoë", made_from={})
    page.session.diagnosis.show()
    page.locator("#addb-diagnosis .decided.accept").get_by_text("accepted by Zoë").wait_for()
    page.locator("#addb-diagnosis header").get_by_text("The next fit uses it.").wait_for()
    accept = page.get_by_role("button", name="Accept cause 1")
    accept.wait_for()
    assert accept.is_disabled()
    assert page.get_by_role("button", name="Reject cause 1").is_enabled()


def test_x_shows_a_diagnosis_that_holds(page, folder, diagnosed, until):
    tab = page.get_by_role("tab", name="Diagnosis", exact=True)
    page.get_by_role("tab", name="Curves", exact=True).click()
    until(lambda: page.session.shared.jobs.progress is None)
    until(lambda: tab.get_attribute("aria-selected") == "false", "another tab")
    page.keyboard.press("x")
    until(lambda: tab.get_attribute("aria-selected") == "true", "the tab")
    assert page.session.shared.jobs.progress is None, "a diagnosis that holds is not made again"
