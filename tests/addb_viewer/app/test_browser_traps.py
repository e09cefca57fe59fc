"""What once misled a reviewer at the page, and does no more."""

import pytest

from addb_viewer.app.queue import queue_controller
from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, ImportLabels
from tests.addb_viewer.chromium import remembering
from tests.patience import PATIENCE_MS

SIZES = [(1280, 800), (1440, 900)]
T, N = "Finish the trial, go to the next", "Next proposal or flagged range"
IN_SIGHT = """(part) => {
    const box = part.getBoundingClientRect(), at = (x, y) => part.contains(document.elementFromPoint(x, y));
    return box.top >= 0 && box.bottom <= innerHeight
        && at(box.left + 2, box.top + box.height / 2) && at(box.right - 2, box.top + box.height / 2);
}"""


@pytest.mark.browser
def test_the_question_and_the_read_out_of_a_trial_go_with_it(page, until):
    timeline = page.locator("[data-addb-timeline]").bounding_box()
    page.mouse.move(timeline["x"] + 300, timeline["y"] + 30)
    readout = page.locator("#addb-readout")
    until(readout.is_visible, "the read-out")
    for _ in range(2):
        page.keyboard.press("Shift+T")
        until(lambda: page.session.questions.waits or page.session.shown == "run", "the question")
    until(lambda: page.locator("#addb-place b").text_content().endswith("run"), "the next trial")
    assert not page.locator("dialog[open]").count()
    assert not readout.is_visible()


@pytest.mark.parametrize("key", ["One frame on", N, "First frame"])
def test_who_has_pressed_another_key_has_looked_at_the_trial(app, enter, monkeypatch, key):
    monkeypatch.setattr(queue_controller, "SEEN_S", 1e6)
    browser = enter(app)
    browser.finish()
    browser.until(lambda: browser.session.shown == "run")
    browser.press(T)
    browser.until(lambda: browser.asked("you have not looked at it"))
    browser.press("No, to the question")
    browser.until(lambda: not browser.questions, "the question to go")
    browser.press(key)
    browser.press(T)
    browser.until(lambda: browser.asked("Finish run?"))
    assert not browser.asked("you have not looked at it")


@pytest.mark.browser
def test_work_does_not_push_keys_that_decide_out_of_the_bar(page, until):
    page.keyboard.press("n")
    until(lambda: page.locator("#addb-bar .act").count() == 2, "accept and reject")
    work = [
        {"text": "Fitting the trajectories of a long subject: trial 3 of 6. " * 3, "seconds": 9, "share": 0.1}
    ]
    solve = {
        "text": "New solve: " + "right knee torque moved by up to 15 N·m, " * 4,
        "worse": False,
        "keys": [["keep", "keep"], ["discard", "discard"]],
    }
    page.session.bar._say(work=work, solve=solve)  # kept, while the range that N plays tells its frames
    page.locator("#addb-work").wait_for()
    for act in page.locator("#addb-bar .act").all():
        assert act.evaluate(IN_SIGHT), act.text_content()


@pytest.mark.browser
@pytest.mark.parametrize("size", SIZES)
def test_nothing_lies_over_a_question_and_the_newest_notice_is_seen(app, open_page, until, size):
    page = open_page(app, size)
    for key in ("Shift+?", "t"):
        page.keyboard.press(key)
        dialog = page.locator("dialog[open]")
        dialog.wait_for()
        assert dialog.evaluate(IN_SIGHT), key
        page.keyboard.press("Escape")
        until(lambda dialog=dialog: not dialog.count(), "the dialog to go")
    for number in range(6):
        page.session.notices.failed(f"Act {number}", "why " * 40)
    newest = page.locator("#addb-notice", has_text="Act 5")
    newest.wait_for()
    newest.evaluate("(part) => (part.style.pointerEvents = 'auto')")  # clicks go through it
    assert newest.evaluate(IN_SIGHT)
    assert page.errors == []
    page.close()


@pytest.fixture
def queue(app, browser):
    """The queue's page; none of its two trials is finished."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(remembering("Zoë"))
    page.goto(f"http://127.0.0.1:{app.server.get_port()}/queue")
    page.rows = page.locator("#space .row:not([hidden])")
    yield page
    page.close()


@pytest.mark.browser
def test_to_do_and_finished_exclude_each_other_and_the_rows_have_the_keys_after_a_click(queue, until):
    until(lambda: queue.rows.count() == 2, "both")
    queue.get_by_role("checkbox", name="Select all that are shown").check()
    queue.get_by_role("button", name="Finished").click()
    assert queue.get_by_role("button", name="To do").get_attribute("aria-pressed") == "false"
    until(lambda: queue.rows.count() == 0, "none is finished")
    assert queue.locator("#selected").text_content().startswith("0 selected; 2 more are filtered out")
    queue.get_by_role("button", name="To do").click()
    until(lambda: queue.rows.count() == 2, "both again")
    queue.keyboard.press("ArrowDown")
    queue.keyboard.press("Enter")
    queue.wait_for_url("**/?at=**")


def test_n_goes_round_and_does_not_stop_at_flags_of_a_file(app, enter, folder):
    with open_log(folder) as log:
        log.append("walk", ImportLabels(((150, 155),), 200, True), "imported")
    browser = enter(app)
    seen = []
    for _ in range(4):
        browser.press(N)
        before = seen[-1:]
        browser.until(lambda before=before: browser.session.review.chosen not in [None, *before], "a stop")
        seen.append(browser.session.review.chosen)
    assert seen == [(20, 30), (60, 80), (100, 110), (20, 30)]


def test_while_it_is_being_fitted_the_page_says_so(tmp_path, make_replay, make_app, enter, monkeypatch):
    app = make_app(tmp_path, [make_replay(fitted=False)], login="Zoë")
    try:
        browser = enter(app)
        assert browser.bar["verdict"]["next"] == ["solve", "fit"]
        monkeypatch.setattr(type(browser.session.shared), "solving", True)
        browser.session.bar.show()
        browser.until(lambda: browser.bar["verdict"]["open"] == "it is being fitted", "the head")
        assert browser.bar["verdict"]["next"] is None
    finally:
        app.close()


def test_frames_that_two_people_dispute_have_a_row_of_the_timeline(app, enter, folder):
    with open_log(folder) as log:
        log.append("walk", FlagRange(30, 50, "notOverForcePlate"), "Bo")
        log.append("walk", FlagRange(40, 60, "forceDiscrepancy"), "Eve")
    browser = enter(app)

    def disputed():
        rows = browser.session.channel.shown("rows")
        return [(b["start"], b["end"]) for row in rows if row["label"] == "disagree" for b in row["blocks"]]

    browser.until(lambda: disputed() == [(40, 50)], "the row")
