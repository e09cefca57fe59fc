"""The queue as a page, in a real browser: what people do there, and how it leads to a frame of a trial."""

import pytest

from tests.addb_viewer.chromium import remembering
from tests.patience import PATIENCE_MS

pytestmark = pytest.mark.browser

SPITEFUL = "<img src=x onerror='window.hacked=1'>"


@pytest.fixture
def queue(tmp_path, browser, make_replay, make_app):
    """The queue's page of two trials."""
    app = make_app(tmp_path, [make_replay(), make_replay(SPITEFUL, fitted=False)], login="Zoë")
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(remembering("Zoë"))
    page.app, page.errors = app, []

    def note(text):
        if page.url.endswith("/queue"):  # viser's page tries to evaluate something, which is refused
            page.errors.append(text)

    page.on("pageerror", lambda error: note(str(error)))
    page.on("console", lambda said: said.type == "error" and note(said.text))
    page.goto(f"http://127.0.0.1:{app.server.get_port()}/queue")
    yield page
    page.close()
    app.close()


def test_a_trial_is_found_assigned_discussed_and_opened_at_a_frame(queue, until):
    rows = queue.locator("#space .row:not([hidden])")
    until(lambda: rows.count() == 2, "both trials")
    assert queue.locator("#addb-strip").count() == 0  # that is of the review page
    assert SPITEFUL in rows.all_inner_texts()[0] + rows.all_inner_texts()[1]  # as text
    queue.keyboard.press("/")
    queue.keyboard.type("onerror")
    until(lambda: rows.count() == 1, "the filter")
    rows.get_by_role("checkbox").check()
    queue.get_by_role("button", name="Take them").click()
    rows.get_by_text("Zoë").first.wait_for()
    rows.get_by_role("button", name="Comments on").click()
    queue.locator("aside input[type=number]").fill("57")
    queue.locator("aside textarea").fill("<b>A stumble?</b>")
    queue.get_by_role("button", name="Comment", exact=True).click()
    queue.get_by_text("<b>A stumble?</b>").wait_for()
    before = set(queue.app.sessions)
    queue.get_by_role("link", name="frame 57").click()
    (client,) = until(lambda: set(queue.app.sessions) - before, "the session")
    session = queue.app.sessions[client]
    until(lambda: (session.shown, session.frame) == (SPITEFUL, 57), "the frame")
    assert queue.evaluate("window.hacked ?? null") is None
    queue.go_back()
    until(lambda: rows.count() == 2, "the queue again")
    assert queue.evaluate("window.hacked ?? null") is None
    assert queue.errors == []
