"""Dropping a selection in a real page, and what is told of failures."""

import pytest

pytestmark = pytest.mark.browser

SIZES = [(1280, 800), (1920, 1080)]


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
def test_escape_and_a_click_into_the_scene_drop_the_selection(app, open_page, until, size):
    page = open_page(app, size)
    session = page.session

    def select():
        page.keyboard.press("n")
        until(lambda: session.review.chosen is not None, "a selection")

    def click_into_the_scene():
        place = page.locator("#root canvas").first.bounding_box()
        page.mouse.click(place["x"] + 0.45 * place["width"], place["y"] + 0.3 * place["height"])

    select()
    page.keyboard.press("Escape")
    until(lambda: session.review.chosen is None, "Esc")
    select()
    page.get_by_text("Reasons and notes").click()
    page.locator("xpath=//*[text()='Note']/following::*[self::input or self::textarea][1]").click()
    page.keyboard.type("seen on video")
    click_into_the_scene()  # gives the keyboard back, and no more
    until(lambda: page.evaluate("document.activeElement.tagName") == "BODY", "the keyboard")
    assert session.review.chosen is not None
    click_into_the_scene()
    until(lambda: session.review.chosen is None, "the click")
    page.keyboard.press("End")
    until(lambda: session.frame == 199)
    page.keyboard.press("5")
    failure = page.get_by_text("Flag: force wrong failed")
    failure.first.wait_for()
    page.keyboard.press("Escape")
    until(lambda: failure.count() == 0, "the failure to go")
    assert session.review.panel.note.value == "seen on video"
    assert page.errors == []
    page.close()
