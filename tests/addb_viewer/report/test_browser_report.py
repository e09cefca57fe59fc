"""Reports in a real browser: offline, playing, printing."""

import pytest

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.overview import Entry, write_overview
from addb_viewer.report.subject_page import write_report
from addb_viewer.trial_view.recorded_subject import recording_of
from tests.patience import PATIENCE_MS

pytestmark = pytest.mark.browser


@pytest.fixture
def opened(browser):
    """Opens a file in a page that remembers errors, refusals and what it asked of the network."""
    pages = []

    def open_(file, **options):
        page = browser.new_page(viewport={"width": 1000, "height": 700}, **options)
        pages.append(page)
        page.set_default_timeout(PATIENCE_MS)
        page.troubles = []
        page.on("pageerror", lambda error: page.troubles.append(str(error)))
        page.on("console", lambda line: page.troubles.append(line.text) if line.type == "error" else None)
        page.on(
            "request",
            lambda asked: (
                None if asked.url.startswith(("data:", "file:", "blob:")) else page.troubles.append(asked.url)
            ),
        )
        page.goto(file.as_uri())
        return page

    yield open_
    for page in pages:
        page.close()


@pytest.fixture
def page(make_fit, diagnosis, tmp_path, opened):
    """The report of two trials, ready to play."""
    recording = recording_of(make_fit("walk", "run"), diagnosis=diagnosis)
    page = opened(write_report(SubjectReport(recording), tmp_path / "report.html"))
    page.wait_for_selector("#player[data-ready]")
    yield page
    assert page.troubles == []


def where(page):
    return page.inner_text("[data-role=where]")


def pixels(page):
    """The canvas right after it was drawn: how many colours it has."""
    return page.evaluate("""() => new Promise((done) => {
        const canvas = document.querySelector("canvas");
        window.dispatchEvent(new Event("resize"));
        requestAnimationFrame(() => {
            const flat = document.createElement("canvas");
            [flat.width, flat.height] = [canvas.width, canvas.height];
            const context = flat.getContext("2d");
            context.drawImage(canvas, 0, 0);
            const data = new Uint32Array(context.getImageData(0, 0, flat.width, flat.height).data.buffer);
            done(new Set(data).size);
        });
    })""")


def test_a_click_on_a_range_leads_there_and_says_why_it_was_left_out(page):
    page.click('[data-seek="0:30"]:has-text("30–35")')
    assert where(page) == "frame 30 of 39, 0.95 s"
    assert "✗ left out — right foot: not over a plate, frames 30–35" in page.inner_text("[data-role=status]")
    page.click('[data-seek="0:0"]:has-text("0–29")')
    assert page.inner_text("[data-role=status]") == "✓ usable"


def test_the_scene_is_drawn_and_turns(page):
    assert pixels(page) > 50


def test_it_plays_to_the_end_and_stops(page):
    page.select_option("[data-role=speed]", "2")
    page.click('[data-seek="0:0"]:has-text("0–29")')
    page.click("[data-role=play]")
    page.get_by_text("frame 39 of 39").wait_for()
    assert "Play" in page.inner_text("[data-role=play]")


def test_keys_and_the_bar_go_from_frame_to_frame(page):
    page.click('[data-seek="0:0"]:has-text("0–29")')
    page.focus("canvas")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    assert where(page) == "frame 3 of 39, 0.41 s"
    page.keyboard.press("End")
    assert where(page).startswith("frame 39 ")
    page.focus("[data-role=bar]")
    page.keyboard.press("ArrowLeft")
    assert where(page).startswith("frame 38 ")


def test_another_trial_is_chosen_from_the_list_and_by_a_click_on_its_curves(page):
    page.select_option("[data-role=trial]", "1")
    page.wait_for_selector(".timeline[data-trial='1'] .cursor:not([hidden])", state="attached")
    assert page.locator(".timeline").nth(0).locator(".cursor").is_hidden()
    box = page.locator(".timeline").nth(0).locator(".area").bounding_box()
    page.locator(".timeline").nth(0).click(position={"x": 66 + box["width"] / 2, "y": 60})
    page.wait_for_selector(".timeline[data-trial='0'] .cursor:not([hidden])", state="attached")
    assert page.input_value("[data-role=trial]") == "0"
    assert where(page).startswith(("frame 19 ", "frame 20 "))


def test_the_page_fits_a_narrow_window_and_follows_the_theme(page):
    page.set_viewport_size({"width": 420, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    background = "getComputedStyle(document.body).backgroundColor"
    assert page.evaluate(background) == "rgb(255, 255, 255)"
    page.emulate_media(color_scheme="dark")
    assert page.evaluate(background) == "rgb(20, 23, 27)"
    page.emulate_media(color_scheme="dark", media="print")
    assert page.evaluate(background) == "rgb(255, 255, 255)"
    assert page.locator("#player").is_hidden()


def test_it_prints(page):
    assert page.pdf(prefer_css_page_size=True).startswith(b"%PDF")


def test_the_overview_sorts_by_a_column_and_back(make_fit, small_fit, tmp_path, opened):
    reports = [SubjectReport(recording_of(fit)) for fit in (small_fit, make_fit("walk"))]
    entries = [
        Entry(f"s{i}", write_report(report, tmp_path / f"{i}.html"), report, "")
        for i, report in enumerate(reports)
    ]
    refused = Entry("s2", None, None, "cannot be read")
    page = opened(write_overview("lab", [refused, *entries], (), tmp_path / "report.html"))

    def column(number):
        return page.locator(f"tbody tr > :nth-child({number})").all_inner_texts()

    page.click("button:has-text('Frames')")
    assert [text for text in column(3) if text] == ["4", "4", "40"]
    assert column(1)[-1] == "s2"
    page.click("button:has-text('Frames')")
    assert [text for text in column(3) if text] == ["40", "4", "4"]
    assert page.get_attribute("th:has(button:has-text('Frames'))", "aria-sort") == "descending"
    page.click("button:has-text('Subject')")
    assert column(1) == ["s0", "s0", "s1", "s2"]
    page.click("a:has-text('s1')")
    page.wait_for_selector("#player[data-ready]")
    assert page.troubles == []
