"""Mouse and timeline in a real browser: where a click leads, what a drag selects, what lies over what."""

import pytest

from addb_viewer.jobs.review_store import open_log

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
    """Left border and width of the timeline's axis, and a height below the rows [pixel]."""
    box = page.locator("[data-addb-timeline]").first.bounding_box()
    timeline = page.locator("[data-addb-timeline]").first
    gutter, margin = (float(timeline.get_attribute(f"data-{side}")) for side in ("gutter", "margin"))
    return box["x"] + gutter, box["width"] - gutter - margin, box["y"] + box["height"] - 40


def test_a_click_goes_to_the_frame_under_it_and_the_cursor_stands_there(page, lanes, until):
    left, width, y = lanes
    for share, frame in ((0.5, 100), (0.25, 50), (1.0, 199), (0.0, 0)):
        page.mouse.click(left + share * width, y)
        until(lambda frame=frame: abs(page.session.frame - frame) <= 1)
        shown = left + width * page.session.frame / 199
        until(lambda shown=shown: abs(left_of(page, "cursor") - shown) < 2.0, f"the cursor at {shown}")


COUNT = """() => {
    const cursor = document.querySelector("[data-addb-cursor]");
    window.places = [];
    const note = () => window.places.push(parseFloat(cursor.style.left));
    new MutationObserver(note).observe(cursor, { attributes: true, attributeFilter: ["style"] });
}"""


def test_the_cursor_goes_ahead_of_the_server_and_never_back(page, until):
    def shown():
        return round(1.99 * page.evaluate("parseFloat(document.getElementById('addb-cursor').style.left)"))

    page.keyboard.press("Home")
    until(lambda: page.session.frame == 0 and shown() == 0)
    page.evaluate(COUNT)
    for _ in range(6):
        page.keyboard.press(".")
    until(lambda: page.session.frame == 6)
    until(lambda: shown() == 6)
    places = page.evaluate("window.places")
    assert places == sorted(places)
    page.evaluate("window.toServer = window.addb.send; window.addb.send = () => {};")
    page.keyboard.press(".")
    assert shown() == 7  # at once
    assert page.session.frame == 6
    until(lambda: shown() == 6, "the server's frame, where it does not come along")
    page.evaluate("window.addb.send = window.toServer;")
    page.keyboard.press(".")
    until(lambda: page.session.frame == 7 and shown() == 7)


def left_of(page, what):
    """Where the cursor or the selection stands [pixel]; far off while the page just puts it elsewhere."""
    box = page.locator(f"[data-addb-{what}]").first.bounding_box()
    return box["x"] if box else -1e9


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
    page.locator("#root").get_by_text("100–109").first.click()
    until(lambda: page.session.frame == 100 and page.session.review.chosen == (100, 110))
    for name in ("run", "walk"):
        page.locator("#addb-place").click()
        page.locator("[data-addb-go-to^='#']", has_text=name).click()
        until(lambda name=name: page.session.shown == name)
    assert not page.session.questions.waits


def test_a_click_selects_a_bar_and_a_border_that_is_dragged_moves_its_flag(page, folder, until):
    page.session.review.select(150, 160)
    page.keyboard.press("5")
    bar = page.locator(".addb-block[data-start='150']").first
    bar.wait_for()
    page.mouse.click(500, 100)  # into the scene: nothing is selected
    until(lambda: page.session.review.chosen is None)
    bar.click()
    until(lambda: page.session.review.chosen == (150, 160))
    box, edge = bar.bounding_box(), bar.locator("[data-side=end]").bounding_box()
    page.mouse.move(edge["x"] + 3, edge["y"] + 4)
    page.mouse.down()
    page.mouse.move(edge["x"] + 3 + box["width"], edge["y"] + 4, steps=4)
    page.mouse.up()
    until(lambda: any(f.start == 150 and abs(f.end - 170) <= 1 for f in flags(folder)), "the longer flag")
    page.locator(".addb-block[data-foot='calcn_l'][data-start='60'][data-end='120']").first.click()
    until(lambda: (page.session.review.chosen, page.session.review.about) == ((60, 120), "calcn_l"))


def flags(folder):
    with open_log(folder) as log:
        return log.review("walk", ("calcn_r", "calcn_l")).flags


def test_the_wheel_zooms_around_the_pointer_and_the_charts_follow(page, lanes, until):
    left, width, y = lanes
    page.mouse.move(left + width / 2, y)
    page.mouse.wheel(0, -800)
    timeline = page.locator("[data-addb-timeline]")
    shown = lambda: [int(timeline.get_attribute(f"data-{side}")) for side in ("first", "last")]  # noqa: E731
    until(lambda: 0 < shown()[0] < 100 < shown()[1] < 199, "the zoom")
    beside = page.locator("#addb-plots-area")
    until(lambda: [int(beside.get_attribute(f"data-{side}")) for side in ("first", "last")] == shown())
    first = shown()[0]
    page.mouse.wheel(200, 0)
    until(lambda: shown()[0] > first, "the pan")
    page.mouse.move(left + width / 2 + 5, y)
    until(lambda: "Residual force:" in page.locator("#addb-readout").inner_text(), "the read-out")
    page.keyboard.press("End")
    until(lambda: shown()[1] == 199, "the page with the cursor")
    page.mouse.wheel(0, 3000)
    until(lambda: shown() == [0, 199], "the whole trial")
