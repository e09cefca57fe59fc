"""The app in a real browser: Debian's Chromium, headless, software rendering."""

import http.server
import threading
import time
from dataclasses import replace

import pytest

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.server import open_server
from solver.errors import CaptureError

pytestmark = pytest.mark.browser

SPITEFUL = "<img src=x onerror='window.hacked=1'>"


@pytest.fixture(scope="module")
def app(tmp_path_factory, make_replay, make_library):
    spiteful = make_replay("measured only", 120, fitted=False)
    spiteful = replace(
        spiteful,
        notes=(SPITEFUL,),
        plates=tuple(replace(p, name=SPITEFUL) for p in spiteful.plates),
        markers=replace(spiteful.markers, names=(SPITEFUL,) * 5),
    )
    library = make_library(
        tmp_path_factory.mktemp("subject"), [make_replay(), spiteful, make_replay("no forces", 80, plates=0)]
    )
    library.broken["torn"] = CaptureError("markers.trc: line 7 is cut off")
    app = ReviewApp(open_server(port=0), library)
    app.open_trial("walk")
    yield app
    app.close()


@pytest.fixture(scope="module")
def page(open_page, app):
    page = open_page(app)
    yield page
    page.close()


@pytest.fixture
def frame_is(until):
    def wait(app, frame):
        until(lambda: app.playback.position.frame == frame, f"frame {frame}; now {app.playback.position}")

    return wait


@pytest.fixture(autouse=True)
def at_the_first_frame(app, page):
    if app.shown != "walk":
        app.open_trial("walk")
    app.playback.seek(0)
    app.playback.play_at(1.0)
    page.mouse.click(450, 20)
    yield
    assert page.errors == []


def test_the_page_shows_the_scene_and_the_plots(app, page):
    scene = app.server.scene
    for node in (
        "markers/measured",
        "bodies/0",
        "plates/0/outline",
        "plates/1/name",
        "forces/0",
        "forces/residual",
    ):
        assert scene.get_handle_by_name(f"/lab/trial/{node}") is not None, node
    page.get_by_text("Residual moment [N·m]").wait_for()
    assert page.locator(".uplot").count() == 4
    assert page.get_by_text("200 at 100 Hz").count() == 1


def test_keys_step_by_a_frame_a_tenth_and_a_second(app, page, frame_is):
    for key, frame in [
        (".", 1), (".", 2), (",", 1), ("PageDown", 101), ("Shift+PageDown", 111), ("Shift+PageUp", 101),
        ("PageUp", 1), ("End", 199), ("Home", 0),
    ]:  # fmt: skip
        page.keyboard.press(key)
        frame_is(app, frame)


def test_space_plays_and_pauses(app, page, until):
    page.keyboard.press("Space")
    until(lambda: app.playback.position.frame > 20)
    page.keyboard.press("Space")
    until(lambda: not app.playback.position.playing)
    box = frame_box(page)
    until(lambda: box.input_value() == str(app.playback.position.frame), "the frame box")


def test_space_after_a_click_on_play_toggles_once(app, page, until):
    page.get_by_role("button", name="Play").click()
    until(lambda: app.playback.position.playing)
    page.keyboard.press("Space")
    until(lambda: not app.playback.position.playing)
    time.sleep(0.5)
    assert not app.playback.position.playing


def test_j_k_l(app, page, until, frame_is):
    page.keyboard.press("End")
    frame_is(app, 199)
    page.keyboard.press("j")
    until(lambda: app.playback.position.frame < 190)
    assert app.playback.position.speed == -1.0
    page.keyboard.press("k")
    until(lambda: not app.playback.position.playing)
    page.keyboard.press("l")
    until(lambda: app.playback.position.playing and app.playback.position.speed == 1.0)


def test_a_typed_frame_is_gone_to(app, page, until):
    box = frame_box(page)
    until(lambda: box.fill("57") or app.playback.position.frame == 57, "frame 57, typed until it stays")
    until(lambda: app.scene.bodies.handles[0].position[0] == pytest.approx(0.57))
    until(lambda: page.locator("input[disabled]").first.input_value() == "2.570 s")


def test_keys_do_not_act_while_a_number_is_typed(app, page):
    box = frame_box(page)
    box.click()
    page.keyboard.press("End")
    page.keyboard.press("j")
    time.sleep(0.5)
    assert app.playback.position.frame == 0
    assert not app.playback.position.playing


def test_keys_act_again_right_after_a_click_or_a_typed_frame(app, page, until, frame_is):
    page.get_by_text("See-through").click()
    until(lambda: app.scene.options.see_through)
    page.keyboard.press(".")
    frame_is(app, 1)
    page.get_by_text("See-through").click()
    until(lambda: not app.scene.options.see_through)
    box = frame_box(page)
    box.fill("30")
    frame_is(app, 30)
    box.press("Enter")
    page.keyboard.press(".")
    frame_is(app, 31)


def test_the_chooser_turns_to_other_trials_even_bare_ones(app, page, until, frame_is):
    for name, frames in [("no forces", 80), ("measured only", 120)]:
        choose(page, name)
        until(lambda name=name: app.shown == name)
        until(lambda frames=frames: app.playback.frames == frames)
        until(lambda: page.evaluate("document.activeElement === document.body"), "the keyboard")
        time.sleep(0.7)  # as long as a list may take the focus back
        page.keyboard.press("End")
        frame_is(app, frames - 1)


def test_names_from_files_stay_text(app, page):
    app.open_trial("measured only")
    page.get_by_text("Notes").first.click()
    page.get_by_text(SPITEFUL).first.wait_for(state="attached")
    time.sleep(1.0)
    assert page.evaluate("window.hacked") is None
    page.get_by_text("Notes").first.click()


def test_a_trial_that_cannot_be_read_says_so_and_the_present_one_stays(app, page, close_notices):
    choose(page, "torn")
    page.get_by_text("markers.trc: line 7 is cut off").wait_for()
    assert app.shown == "walk"
    assert app.controls.trial.value == "walk"
    close_notices(page)


def test_following_keeps_the_person_in_the_middle_and_stops_without_a_jump(app, page, until):
    app.playback.seek(150)
    until(lambda: abs(app.scene.lab.position[0] + 1.5) < 1e-6)
    page.get_by_text("Follow", exact=True).click()
    until(lambda: not app.scene.options.follow)
    app.playback.seek(50)
    until(lambda: app.scene.bodies.handles[0].position[0] == pytest.approx(0.5))
    assert app.scene.lab.position[0] == pytest.approx(-1.5)
    page.get_by_text("Follow", exact=True).click()
    until(lambda: app.scene.options.follow)
    assert app.scene.lab.position[0] == pytest.approx(-1.5)
    app.scene.anchor[:] = 0.0
    app.playback.redraw()


def test_another_web_page_cannot_connect(app, browser, tmp_path):
    (tmp_path / "index.html").write_text("<p>a page of somebody else</p>")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args):
            super().__init__(*args, directory=str(tmp_path))

        def log_message(self, *args):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet) as stranger:
        threading.Thread(target=stranger.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{stranger.server_address[1]}")
        outcome = page.evaluate(
            """port => new Promise(done => {
                const socket = new WebSocket(`ws://127.0.0.1:${port}`, "viser-v1.1.1");
                socket.onopen = () => done("open");
                socket.onerror = () => done("refused");
            })""",
            app.server.get_port(),
        )
        page.close()
        stranger.shutdown()
    assert outcome == "refused"


def frame_box(page):
    return page.locator("input[inputmode]").first


def choose(page, trial):
    page.get_by_text("Trial", exact=True).first.click()
    page.get_by_role("option", name=trial).click(timeout=10_000)
