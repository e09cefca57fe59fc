"""The reviewer's whole loop on the demo subject, in a real browser, with the real solver."""

import json
import re

import numpy as np
import pytest

from addb_viewer.app.app import start
from addb_viewer.jobs.stored_solves import KEPT, NEW, REPLACED, stored_solves
from annotations.events import Status
from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.results.store import save_fit
from solver.fitting.settings import settings_for
from solver.simulate.demo_subject import write_demo_subject
from tests.addb_viewer.app.ten_trials import NO_HELD_OUT
from tests.addb_viewer.chromium import resting_box
from tests.patience import PATIENCE_S

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The demo's subject, fitted; its walk misses one plate."""
    folder = tmp_path_factory.mktemp("loop") / "demo"
    folder.mkdir()
    write_demo_subject(folder, np.random.default_rng(3), trials=("static", "walk", "squat"))
    (folder / "settings.toml").write_text(NO_HELD_OUT)
    save_fit(solve(open_subject(folder), settings_for(folder)), folder / "results")
    return folder


def flags(review):
    return [(f.start, f.end, f.foot, f.reason) for f in review.flags]


@pytest.mark.slow
def test_open_play_step_select_paint_undo_redo_accept_solve_compare_finish_next(  # noqa: PLR0915 (one loop)
    folder, open_page, until, stored
):
    app = start(folder, port=0)
    try:
        page = open_page(app)
        session = page.session
        assert session.shown == "walk"  # the worst one

        page.keyboard.press("Space")
        until(lambda: session.frame > 10)
        page.keyboard.press("Space")
        until(lambda: not session.playback.position.playing)
        page.keyboard.press("Home")
        page.keyboard.press(".")
        until(lambda: session.frame == 1)

        # by drag
        timeline = page.locator("[data-addb-timeline]").first
        box, last = resting_box(timeline), session.replay.frames - 1
        left = box["x"] + float(timeline.get_attribute("data-gutter"))
        width = box["x"] + box["width"] - float(timeline.get_attribute("data-margin")) - left
        page.mouse.move(left + width * 20 / last, box["y"] + 40)
        page.mouse.down()
        page.mouse.move(left + width * 40 / last, box["y"] + 40, steps=5)
        page.mouse.up()
        until(lambda: session.review.chosen is not None)
        dragged = session.review.chosen
        page.keyboard.press("8")
        until(lambda: flags(stored()) == [(*dragged, None, "tooHighMarkerRMS")])
        page.get_by_text("markers bad").first.wait_for()
        page.keyboard.press("u")
        until(lambda: flags(stored()) == [])
        page.keyboard.press("r")
        until(lambda: flags(stored()) == [(*dragged, None, "tooHighMarkerRMS")])
        page.keyboard.press("0")
        until(lambda: flags(stored()) == [])

        # by keys
        page.keyboard.press("Home")
        until(lambda: session.frame == 0)
        page.keyboard.press("i")
        page.keyboard.press("PageDown")
        page.keyboard.press("o")
        page.keyboard.press("f")
        page.keyboard.press("3")
        by_key = (0, 101, "calcn_r", "unmeasuredExternalForceDetected")
        until(lambda: by_key in flags(stored()))
        page.keyboard.press("u")
        until(lambda: flags(stored()) == [])

        # proposals: the step beside the plate is among them
        page.keyboard.press("Home")
        until(lambda: session.frame == 0)
        presses = 0
        page.keyboard.press("n")
        until(lambda: session.review.current is not None)
        while session.review.current is not None:
            before = len(stored().judged(last + 1).nonzero()[0])
            page.keyboard.press("Enter")
            presses += 1
            until(lambda before=before: len(stored().judged(last + 1).nonzero()[0]) > before)
            session.notices._hand.submit(lambda: None).result(PATIENCE_S)
        assert presses < 30
        assert any(foot == "calcn_r" and start < 150 < end for start, end, foot, _ in flags(stored()))

        # detection had left them out already: a flag of one's own is something to solve
        page.keyboard.press("End")
        until(lambda: session.frame == last)
        page.keyboard.press("o")
        page.keyboard.press("PageUp")
        page.keyboard.press("i")
        before = len(flags(stored()))
        page.keyboard.press("3")
        until(lambda: len(flags(stored())) > before)

        page.get_by_role("tab", name="Solve", exact=True).click()
        page.keyboard.press("g")
        page.locator("#addb-work").wait_for()
        page.keyboard.press("End")  # the page stays alive
        until(lambda: session.frame == last)
        until(lambda: session.shared.fits.new is not None, "the solve")
        page.get_by_text("A new solve is on the screen.").wait_for()
        page.get_by_text("Frames whose forces count differently").wait_for()
        until(lambda: session.scene.other is not None)
        for chart in ("#addb-plots figure:has-text('Knee flexion torque')", ".addb-title"):
            page.locator(chart, has_text=" → ").first.wait_for()  # the value before, and now
        until(lambda: page.locator("#addb-plots figure").first.locator(".addb-plot-values span").count() == 3)
        page.keyboard.press("m")
        until(lambda: session.scene.other is None)
        page.keyboard.press("m")
        until(lambda: session.scene.other is not None)
        assert [s.state for s in stored_solves(folder / "results")] == [NEW]
        page.locator("#root").get_by_role("button", name="Keep", exact=True).click()
        until(lambda: session.shared.fits.new is None)
        assert {s.state for s in stored_solves(folder / "results")} == {KEPT, REPLACED}
        fit = json.loads((folder / "results" / "fit.json").read_text())
        assert next(t for t in fit["trials"] if t["name"] == "walk")["mask_source"] == "review"

        page.keyboard.press("t")
        until(lambda: session.shown != "walk" or session.questions.waits)
        if session.questions.waits:
            page.keyboard.press("t")
        until(lambda: session.shown != "walk")
        assert stored().status is Status.FINISHED

        # reloaded
        kept = flags(stored())
        page.reload()
        page.wait_for_selector("canvas")
        page.locator("#addb-place").click()
        page.get_by_text(re.compile(r"^1 of \d+ trials are finished")).wait_for()
        assert page.errors == []
        page.close()
    finally:
        app.close()

    # and started again
    app = start(folder, port=0)
    try:
        page = open_page(app)
        assert page.session.shown != "walk"  # that is finished, so the next one is opened
        page.session.notices.do("Opening", lambda: page.session.open_trial("walk"))
        until(lambda: page.session.shown == "walk")
        page.get_by_text("Finished").first.wait_for()
        assert flags(stored()) == kept
        assert page.session.replay.forces.source == "review"
        assert page.errors == []
        page.close()
    finally:
        app.close()
