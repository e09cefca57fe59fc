"""Mouse and timeline in a real browser: where a click leads, what a drag selects, what lies over what."""

import pytest

from addb_viewer.review_store import open_log

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("subject")


@pytest.fixture(scope="module")
def app(folder, make_replay, make_app):
    app = make_app(folder, [make_replay(), make_replay("run", 180)], login="Zoë")
    yield app
    app.close()


@pytest.fixture(scope="module")
def page(open_page, app):
    page = open_page(app)
    yield page
    assert page.errors == []
    page.close()


@pytest.fixture
def lanes(page):
    """Left border and width of the lanes' time axis, and a height inside them [pixel]."""
    box = page.locator("[data-addb-timeline]").first.bounding_box()
    timeline = page.locator("[data-addb-timeline]").first
    gutter, margin = (float(timeline.get_attribute(f"data-{side}")) for side in ("gutter", "margin"))
    return box["x"] + gutter, box["width"] - gutter - margin, box["y"] + 40


def test_a_click_goes_to_the_frame_under_it_and_the_cursor_stands_there(page, lanes, until):
    left, width, y = lanes
    for share, frame in ((0.5, 100), (0.25, 50), (1.0, 199), (0.0, 0)):
        page.mouse.click(left + share * width, y)
        until(lambda frame=frame: abs(page.session.frame - frame) <= 1)
        shown = left + width * page.session.frame / 199
        until(lambda shown=shown: abs(left_of(page, "cursor") - shown) < 2.0, f"the cursor at {shown}")


def left_of(page, what):
    """Where the cursor or the selection stands [pixel]; far off while the page just puts it elsewhere."""
    box = page.locator(f"[data-addb-{what}]").first.bounding_box()
    return box["x"] if box else -1e9


def test_the_cursor_covers_lanes_and_charts_and_no_more(page):
    lanes, charts = (page.locator("[data-addb-timeline]").nth(i).bounding_box() for i in (0, 1))
    cursor = page.locator("[data-addb-cursor]").first.bounding_box()
    assert cursor["y"] == pytest.approx(lanes["y"], abs=1.5)
    bottom = charts["y"] + charts["height"]
    assert bottom - 34 <= cursor["y"] + cursor["height"] <= bottom  # all but the time axis


def test_a_drag_selects_and_a_key_paints_it(page, lanes, folder, until):
    left, width, y = lanes
    page.mouse.move(left + width * 120 / 199, y)
    page.mouse.down()
    page.mouse.move(left + width * 139 / 199, y, steps=6)
    page.mouse.up()
    until(lambda: page.session.review.chosen is not None)
    start, end = page.session.review.chosen
    assert abs(start - 120) <= 1
    assert abs(end - 140) <= 1
    assert page.session.frame == start
    border = left + width * (start - 0.5) / 199
    until(lambda: abs(left_of(page, "selection") - border) < 2.0, "the selection on the page")
    page.keyboard.press("1")

    def painted():
        with open_log(folder) as log:
            return [(f.start, f.end) for f in log.review("walk", ("calcn_r", "calcn_l")).flags]

    until(lambda: painted() == [(start, end)])
    page.get_by_text(f"{start}–{end - 1}").first.wait_for()


def test_backwards_and_beyond_the_border_it_is_the_same_range(page, lanes, until):
    left, width, y = lanes
    page.mouse.move(left + width * 30 / 199, y)
    page.mouse.down()
    page.mouse.move(left - 300, y, steps=4)
    page.mouse.up()
    until(lambda: page.session.review.chosen is not None and page.session.review.chosen[0] == 0)
    assert abs(page.session.review.chosen[1] - 31) <= 1


def test_a_click_on_a_proposal_and_on_a_row_of_the_queue_leads_there(page, until):
    page.get_by_text("100–109").first.click()
    until(lambda: page.session.frame == 100 and page.session.review.chosen == (100, 110))
    page.get_by_role("tab", name="Queue", exact=True).click()
    page.locator("[data-addb-go-to^='#']", has_text="run").click()
    until(lambda: page.session.shown == "run")
    page.locator("[data-addb-go-to^='#']", has_text="walk").click()
    until(lambda: page.session.shown == "walk")
    page.get_by_role("tab", name="Review", exact=True).click()


def test_a_page_of_the_trial_turns_with_the_cursor(page, until):
    session = page.session
    session.timeline.drawn.zoom(100)
    session.seek(0)
    until(lambda: session.timeline.drawn.span.first == 0)
    session.seek(150)
    until(lambda: session.timeline.drawn.span.first <= 150 <= session.timeline.drawn.span.last)
    timeline = page.locator("[data-addb-timeline]").first
    until(lambda: timeline.get_attribute("data-last") == str(session.timeline.drawn.span.last))
    session.timeline.drawn.zoom(None)
    session.seek(0)


def test_without_the_scripts_the_box_does_the_same(app, open_page, until, monkeypatch):
    monkeypatch.setattr(app.server.own, "head", "")
    page = open_page(app)
    box = page.locator("label:has-text('Go to')").locator("xpath=ancestor::*[.//input][1]//input").first
    box.fill("120:140")
    until(lambda: page.session.review.chosen == (120, 140))
    box.fill("57")
    until(lambda: page.session.frame == 57)
    page.close()
