"""Dialogs in a real browser: typed, answered by key, and out of the way of what lies below."""

import pytest

from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, Status

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("people")


@pytest.fixture(scope="module")
def app(folder, make_replay, make_app):
    app = make_app(folder, [make_replay(), make_replay("run", 180)], login="ada")
    yield app
    app.close()


def test_the_name_is_typed_and_entered_and_the_key_before_is_obeyed(app, open_page, stored, until):
    page = open_page(app, name=None)
    try:
        page.keyboard.press("1")
        page.get_by_text("Who is reviewing?").wait_for()
        box = page.get_by_role("dialog").get_by_role("textbox")
        assert box.input_value() == "ada"
        page.keyboard.press("Escape")
        until(lambda: page.get_by_role("dialog").count() == 0, "the dialog to go")
        page.keyboard.press("1")
        page.get_by_text("Who is reviewing?").wait_for()
        page.keyboard.press("Control+a")  # the box has the focus
        page.keyboard.type("Zoë 1")  # with a key of ours in it
        page.keyboard.press("Enter")
        until(lambda: [f.author for f in stored().flags] == ["Zoë 1"])
        until(lambda: page.get_by_role("dialog").count() == 0, "the dialog to go")
        page.reload()
        page.locator("#addb-place b").wait_for()
        page.get_by_text("Zoë 1").first.wait_for(state="attached")
        assert page.errors == []
    finally:
        page.close()


def test_t_says_what_speaks_against_it_and_t_again_finishes(app, folder, open_page, stored, until):
    with open_log(folder) as log:
        for author, reason in (("Bo", "notOverForcePlate"), ("Eve", "forceDiscrepancy")):
            log.append("walk", FlagRange(30, 50, reason), author)
    page = open_page(app)
    try:
        session = page.session
        assert session.shown == "walk"
        for _ in range(2):
            page.keyboard.press("t")
            page.get_by_text("Two people disagree about frames 30 to 49").first.wait_for()
            assert stored().status is not Status.FINISHED
            page.keyboard.press("Escape")
            until(lambda: not session.questions.waits, "Esc")
        page.keyboard.press("t")
        until(lambda: session.questions.waits, "the question")
        page.keyboard.press("t")
        until(lambda: stored().status is Status.FINISHED)
        until(lambda: session.shown == "run")
        assert page.errors == []
    finally:
        page.close()
