"""Whether everybody can read and hear the pages: axe-core finds no serious fault, in either theme.

It looks at viser's controls as well: what is wrong with them, our style and our script corrected. No fault
is excepted.
"""

import json

import pytest

from addb_viewer.app.app import start
from tests.addb_viewer.app.root_of_many import write_root
from tests.patience import PATIENCE_MS

axe = pytest.importorskip("axe_playwright_python.base", reason="axe-playwright-python is not installed")
pytestmark = pytest.mark.browser

SERIOUS = ("serious", "critical")
TRIALS = 30  # in the queue: more than are in sight
LOOKS = 3  # viser's controls get their names up to 0.3 s after they are drawn
# Drawings that lie over texts of the timeline, see-through: axe could not tell what is behind the texts.
OVERLAYS = "#addb-curves, #addb-over"
MOST_SIZES = 4  # of type
SIZES = """() => {
    const sizes = new Set();
    for (const element of document.querySelectorAll("body *")) {
        const isText = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
        if (isText && element.checkVisibility({visibilityProperty: true}) && element.getClientRects().length)
            sizes.add(getComputedStyle(element).fontSize);
    }
    return [...sizes];
}"""
FADED = """async () => {
    const frame = () => new Promise((done) => requestAnimationFrame(done));
    await frame(), await frame();
    const ends = document.getAnimations().filter((a) => a.effect.getComputedTiming().endTime < Infinity);
    await Promise.allSettled(ends.map((a) => a.finished));
}"""


@pytest.fixture(scope="module")
def review(tmp_path_factory, make_replay, make_app, open_page, effect, figures):  # noqa: PLR0917 (fixtures)
    """The review page of a trial with proposals and a diagnosis."""
    folder = tmp_path_factory.mktemp("subject")
    told = figures(
        effect("clock_offset", "all", offset_s=0.0123),
        effect("external_contact", "pelvis", ((120, 140), (170, 180)), force_y_N=60.0),
    )
    (folder / "results").mkdir()
    kept = told.as_json() | {"made_from": {"provenance": {}, "settings": {}}}
    (folder / "results" / "diagnosis.json").write_text(json.dumps(kept))
    app = make_app(folder, [make_replay(), make_replay("measured only", 120, fitted=False)], login="Zoë")
    page = open_page(app)
    page.evaluate(axe.AXE_SCRIPT)  # by the debugger, which the page's policy does not concern
    for overlay in page.locator(OVERLAYS).all():
        overlay.evaluate("(element) => (element.style.visibility = 'hidden')")
    yield page
    assert page.errors == []
    page.close()
    app.close()


@pytest.fixture(scope="module")
def queue(tmp_path_factory, browser):
    """The queue's page of many trials in all states."""
    root = tmp_path_factory.mktemp("queue") / "root"
    write_root(root, TRIALS)
    app = start(root, port=0)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"http://127.0.0.1:{app.server.get_port()}/queue")
    page.locator("#space .row:not([hidden]) a").nth(10).wait_for()
    page.evaluate(axe.AXE_SCRIPT)
    yield page
    page.close()
    app.close()


def in_theme(page, dark):
    """The system wishes it; the page's own switch turns it round, and back."""
    attribute, press = (
        ("data-theme", "document.getElementById('theme').click()")
        if page.url.endswith("/queue")
        else ("data-mantine-color-scheme", "window.addb.send('do', 'theme')")
    )
    wanted, other = ("dark", "light") if dark else ("light", "dark")
    page.emulate_media(color_scheme=wanted)
    page.locator(f"html[{attribute}={wanted}]").wait_for()
    for pressed in (other, wanted):
        page.evaluate(press)
        page.locator(f"html[{attribute}={pressed}]").wait_for()


def serious_faults(page):
    """Rule, element and what is wrong with it."""
    page.evaluate(FADED)
    found = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")["violations"]
    return [
        f"{fault['id']}: {node['html'][:200]} {node['failureSummary']}"
        for fault in found
        if fault["impact"] in SERIOUS
        for node in fault["nodes"]
    ]


def assert_no_serious_fault(page):
    sizes = page.evaluate(SIZES)
    assert len(sizes) <= MOST_SIZES, sizes
    for _ in range(LOOKS):
        if not (faults := serious_faults(page)):
            return
    pytest.fail("\n".join(faults))


def proposals(page):
    page.get_by_role("tab", name="Review", exact=True).click()
    page.keyboard.press("n")
    page.locator("#addb-chips kbd").first.wait_for()


def failed_solve(page):
    page.get_by_role("tab", name="Solve", exact=True).click()
    page.session.notices.failed("Solving", "walk.mot: line 7 is cut off")
    page.locator("#addb-notice.error").wait_for()
    page.locator("#addb-notices").click()
    page.locator("#addb-notes .error").first.wait_for()


def diagnosis(page):
    page.get_by_role("tab", name="Diagnosis").click()
    page.locator("#addb-diagnosis article").first.wait_for()


def keys(page):
    page.keyboard.press("?")
    page.get_by_role("dialog").get_by_text("Keys").first.wait_for()


@pytest.mark.slow
@pytest.mark.parametrize("state", [proposals, failed_solve, diagnosis, keys])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_review_page_has_no_serious_fault(review, until, dark, state):
    in_theme(review, dark)
    state(review)
    try:
        assert_no_serious_fault(review)
    finally:
        review.keyboard.press("Escape")
        until(lambda: review.get_by_role("dialog").count() == 0, "the dialog to go")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_queue_has_no_serious_fault(queue, dark):
    in_theme(queue, dark)
    if not dark:
        queue.locator("#space input[type=checkbox]").first.check()
        queue.locator("#show-people").click()
        queue.locator("aside table").first.wait_for()
    assert_no_serious_fault(queue)
