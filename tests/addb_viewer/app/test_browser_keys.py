"""Keys in a real browser: of any layout, hidden from the page's camera, and not taken from what is typed."""

import numpy as np
import pytest

from addb_viewer.app.shell.commands import COMMANDS, with_keys
from annotations.events import Status

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

SHIFT = 8  # of Chromium's protocol
LAYOUTS = [
    ("German", "KeyY", "z", 0, None),
    ("German", "KeyZ", "y", 0, "yes"),
    ("German", "Minus", "?", SHIFT, "help"),
    ("French", "Digit1", "&", 0, "flag_1"),
    ("French", "Digit1", "1", SHIFT, "flag_1"),
    ("Russian", "KeyT", "е", 0, "finish"),
    ("Russian", "KeyT", "Е", SHIFT, "finish_sure"),
    ("American", "Digit1", "!", SHIFT, None),
    ("American, capitals locked", "KeyT", "T", 0, "finish"),
]
HEAR = """() => {
    window.heard = [];
    window.addb.send = (kind, action) => kind === "do" && window.heard.push(action);
    document.documentElement.addEventListener("keydown", () => window.heard.push(null));
}"""  # the action that is asked for, or null where the key itself goes on to the page


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("keys")


@pytest.fixture(scope="module")
def page(folder, make_replay, make_app, open_page):
    commands = with_keys(COMMANDS, {"foot": ("H",), "last": ("E",)})
    app = make_app(folder, [make_replay(), make_replay("run", 180)], login="Zoë", commands=commands)
    page = open_page(app)
    yield page
    assert page.errors == []
    page.close()
    app.close()


@pytest.fixture
def at(page, until):
    """The cursor is there, or a selection that begins there is being played."""
    review = page.session.review
    return lambda frame: until(
        lambda: page.session.frame == frame or (review.chosen or (None,))[0] == frame, f"frame {frame}"
    )


def test_a_box_that_has_just_gone_takes_no_key(page, at):
    at(0)
    page.evaluate("""() => {
        const box = document.body.appendChild(document.createElement("input"));
        box.focus();
        setTimeout(() => { // nothing is drawn before the key comes
            for (const end = performance.now() + 1000; performance.now() < end;);
        });
        box.style.display = "none";
    }""")
    page.keyboard.press(".")
    at(1)
    page.keyboard.press("Home")
    at(0)


def test_arrows_and_letters_move_the_cursor_and_not_the_camera(page, at):
    page.mouse.click(640, 300)
    stood = tuple(page.session.client.camera.position)
    for key, frame in (
        ("ArrowRight", 1), (".", 2), ("ArrowLeft", 1), ("Shift+ArrowRight", 11), ("PageDown", 111),
        ("e", 199), ("Home", 0), ("ArrowDown", 20), ("w", 199), ("ArrowUp", 100), ("ArrowUp", 60),
    ):  # fmt: skip
        page.keyboard.press(key)
        at(frame)
    page.wait_for_timeout(300)  # a camera that flies says so every 50 ms
    np.testing.assert_allclose(page.session.client.camera.position, stood, atol=1e-6)  # m; it may come anew


def test_edits_are_undone_as_anywhere_and_chosen_keys_act(page, until, stored):
    for key, accepted in (("Enter", True), ("Control+z", False), ("Control+Shift+z", True)):
        page.keyboard.press(key)
        until(lambda accepted=accepted: bool(stored().accepted) is accepted, key)
    about = page.session.review.about
    page.keyboard.press("h")
    until(lambda: page.session.review.about != about, "the next foot")


def test_the_keys_are_shown_by_one_of_them(page, until, stored):
    dialog, before = page.get_by_role("dialog"), stored()
    for away in ("Enter", "?", "Escape"):  # Enter presses the dialog's button, and decides nothing
        page.keyboard.press("?")
        dialog.get_by_text("Accept what is sure").wait_for()
        dialog.get_by_text("H", exact=True).wait_for()
        page.keyboard.press(away)
        until(lambda: dialog.count() == 0, away)
    assert stored() == before


def test_typing_is_nobodys_key(page, at, stored):
    before, box = stored(), page.locator("#addb-curve-search")
    box.fill("30")
    for key in ("Control+z", "ArrowLeft", "t", "Backspace"):
        box.press(key)
    box.press("Escape")
    page.keyboard.press("Home")
    at(0)
    assert stored() == before


def test_a_key_that_is_held_is_one_t_and_shift_t_finishes(page, until, stored):
    for _ in range(3):
        page.keyboard.down("t")  # the second one repeats
    page.get_by_text("Finish walk?").wait_for()
    page.wait_for_timeout(300)
    page.keyboard.up("t")
    assert stored().status is not Status.FINISHED
    assert page.session.shown == "walk"
    page.keyboard.press("Escape")
    until(lambda: not page.session.questions.waits, "Esc")
    page.keyboard.press("Shift+T")
    page.get_by_text("Finish walk?").wait_for()
    page.keyboard.press("Shift+T")
    until(lambda: page.session.shown == "run")
    assert stored().status is Status.FINISHED


def test_the_letter_counts_that_a_keyboard_prints(page, until):
    protocol = page.context.new_cdp_session(page)
    page.evaluate(HEAR)
    for layout, code, key, held, action in LAYOUTS:
        event = {"type": "rawKeyDown", "code": code, "key": key, "modifiers": held}
        protocol.send("Input.dispatchKeyEvent", event)
        until(lambda: page.evaluate("() => window.heard.length"), layout)
        assert (layout, page.evaluate("() => window.heard.pop()")) == (layout, action)
        protocol.send("Input.dispatchKeyEvent", {**event, "type": "keyUp"})
