"""The app in a real browser: Debian's Chromium, headless, software rendering."""

import time
from dataclasses import replace

import pytest

from addb_viewer.app.shell.actions import actions_of
from solver.common.errors import CaptureError
from solver.common.notes import Kind, noted

pytestmark = pytest.mark.browser

SPITEFUL = "<img src=x onerror='window.hacked=1'>"


@pytest.fixture(scope="module")
def app(tmp_path_factory, make_replay, make_app):
    spiteful = make_replay("measured only", 120, fitted=False)
    spiteful = replace(
        spiteful,
        notes=noted(Kind.OTHER, SPITEFUL),
        plates=tuple(replace(p, name=SPITEFUL) for p in spiteful.plates),
        markers=replace(spiteful.markers, names=(SPITEFUL,) * 5),
    )
    replays = [make_replay(), spiteful, make_replay("no forces", 80, plates=0)]
    app = make_app(tmp_path_factory.mktemp("subject"), replays, login=SPITEFUL)
    app.subjects.loaded[0].fits.shown.broken["torn"] = CaptureError("markers.trc: line 7 is cut off")
    yield app
    app.close()


@pytest.fixture(scope="module")
def page(open_page, app):
    page = open_page(app, name=SPITEFUL)
    yield page
    page.close()


@pytest.fixture
def session(page):
    return page.session


@pytest.fixture
def frame_is(until):
    def wait(session, frame):
        until(lambda: session.frame == frame, f"frame {frame}; now {session.playback.position}")

    return wait


@pytest.fixture(autouse=True)
def at_the_first_frame(session, page):
    if session.shown != "walk":
        session.open_trial("walk")
    session.playback.pause()
    session.playback.faster()  # from rest: at real time
    session.playback.seek(0)
    page.mouse.click(360, 100)
    yield
    assert page.errors == []


def test_the_page_shows_the_scene_and_the_plots(session, page):
    scene = session.client.scene
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
    page.get_by_text("Knee flexion torque [N·m]").wait_for()
    page.get_by_role("tab", name="Fit", exact=True).click()
    page.get_by_text("200 at 100 Hz").wait_for()
    page.get_by_role("tab", name="Review", exact=True).click()


def test_keys_step_by_a_frame_a_tenth_and_a_second(session, page, frame_is):
    for key, frame in [
        (".", 1), (".", 2), (",", 1), ("PageDown", 101), ("Shift+PageDown", 111), ("Shift+PageUp", 101),
        ("PageUp", 1), ("End", 199), ("Home", 0),
    ]:  # fmt: skip
        page.keyboard.press(key)
        frame_is(session, frame)


def test_space_plays_and_pauses(session, page, until):
    page.keyboard.press("Space")
    until(lambda: session.playback.position.frame > 20)
    page.keyboard.press("Space")
    until(lambda: not session.playback.position.playing)
    page.get_by_text(f"frame {session.frame} · ").wait_for()


def test_a_typed_frame_is_gone_to_and_keys_do_not_act_meanwhile(session, page, until):
    session.notices.do("Going there", actions_of(session)["go_to"])
    box = page.get_by_label("A frame, as 57, or frames to select, as 120-179")
    box.fill("5x")
    page.keyboard.press("Enter")
    page.get_by_text("write a frame, as 57").wait_for()
    page.keyboard.press("j")
    box.fill("57")
    assert (session.frame, session.playing) == (0, False)
    page.keyboard.press("Enter")
    until(lambda: session.scene.bodies.handles[0].position[0] == pytest.approx(0.57))
    page.get_by_text("frame 57 · 2.570 s").wait_for()


def test_keys_act_again_right_after_a_click(session, page, until, frame_is):
    page.get_by_role("tab", name="View", exact=True).click()
    page.get_by_text("See-through").click()
    until(lambda: session.scene.options.see_through)
    until(lambda: page.evaluate("document.activeElement === document.body"), "the keyboard")
    page.keyboard.press(".")
    frame_is(session, 1)
    page.get_by_text("See-through").click()
    until(lambda: not session.scene.options.see_through)


def test_the_chooser_turns_to_other_trials_even_bare_ones(session, page, until, frame_is):
    for name, frames in [("no forces", 80), ("measured only", 120)]:
        choose(page, name)
        until(lambda name=name: session.shown == name)
        until(lambda frames=frames: session.playback.frames == frames)
        until(lambda: page.evaluate("document.activeElement === document.body"), "the keyboard")

        def at_the_end(frames=frames):  # a list may take the focus back once more
            page.keyboard.press("End")
            return session.frame == frames - 1

        until(at_the_end, "the last frame")


def test_names_from_files_stay_text(session, page):
    session.open_trial("measured only")
    page.keyboard.press("9")  # by a reviewer of a spiteful name
    session.open_trial("measured only")
    page.keyboard.press("c")
    page.get_by_text("trials are finished").wait_for()
    page.keyboard.press("Escape")
    for tab in ("Fit", "Solve", "View", "Review"):
        page.get_by_role("tab", name=tab, exact=True).click()
        time.sleep(0.3)
        if tab == "Fit":
            page.get_by_text(SPITEFUL).first.wait_for(state="attached")
    time.sleep(1.0)
    assert page.evaluate("window.hacked") is None


def test_a_trial_that_cannot_be_read_says_so_and_the_present_one_stays(session, page):
    session.notices.do("Opening the trial", lambda: session.open_trial("torn"))
    page.get_by_text("markers.trc: line 7 is cut off").wait_for()
    assert session.shown == "walk"


def choose(page, trial):
    page.keyboard.press("c")
    page.get_by_role("button", name=trial).click()
