"""The scene in a real page: names of plates, measuring by clicks, bones that show torques."""

import threading

import numpy as np
import pytest
from PIL import Image

from addb_viewer.app.scene.camera import eye_of
from addb_viewer.app.scene.tints import RESIDUAL
from addb_viewer.app.subjects.video_header import read_header
from addb_viewer.app.subjects.videos import TrialVideo

pytestmark = pytest.mark.browser


@pytest.fixture
def page(tmp_path, make_replay, make_app, open_page):
    app = make_app(tmp_path, [make_replay(), make_replay("run", 180)], login="Zoë")
    page = open_page(app)
    yield page
    assert page.errors == []
    page.close()
    app.close()


def test_labels_are_in_the_picture_and_clicks_measure_what_is_seen(page, until):
    session = page.session
    canvas = page.locator("#root canvas").first.bounding_box()
    until(lambda: session.picture == (canvas["width"], canvas["height"]), "the size of the picture")
    page.wait_for_timeout(1000)  # the camera glides

    def seen(point):
        eye = eye_of(session.client.camera, session.picture)
        (place,), _ = eye.project(np.array([point]) + session.scene.lab.position)
        return place

    for label in session.scene.plates.labels:
        (x, y), (width, height) = seen(label.handle.position), label.size
        assert width / 2 <= x <= canvas["width"] - width / 2
        assert height / 2 <= y <= canvas["height"] - height / 2

    def click(point):
        x, y = seen(point)
        page.mouse.click(canvas["x"] + x, canvas["y"] + y)

    page.keyboard.press("n")
    until(lambda: session.review.chosen is not None)
    page.keyboard.press("Home")
    page.keyboard.press("d")
    until(lambda: session.controls.show.measure.value, "the tool")
    page.get_by_role("tab", name="View", exact=True).click()
    for count, point in enumerate(([0, 1.7, 0], [0.1, 0.05, 0.1]), start=1):
        click(point)
        until(lambda count=count: len(session.scene.measuring.spots) == count, "a click")
    assert [spot.words for spot in session.scene.measuring.spots] == ["HEAD", "RTOE"]
    page.get_by_text("1.656 m").wait_for()  # √(0.1² + 1.65² + 0.1²)
    assert session.review.chosen is not None, "a click that measures drops no selection"
    page.keyboard.press("Escape")
    until(lambda: not (session.scene.measuring.on or session.controls.show.measure.value), "the end of it")

    page.get_by_text("Bones show", exact=True).first.click()
    page.get_by_role("option", name=RESIDUAL).click()
    until(lambda: session.scene.options.tint == RESIDUAL)
    page.get_by_text("2 times its limit").wait_for()


@pytest.mark.slow
def test_a_picture_a_clip_and_a_film_have_the_frames_that_were_asked_for(tmp_path, page):
    session = page.session
    page.get_by_role("tab", name="View", exact=True).click()
    session.seek(50)
    with page.expect_download() as picture:
        page.get_by_role("button", name="PNG", exact=True).click()
    assert picture.value.suggested_filename == "walk-50.png"
    image = Image.open(picture.value.path())
    assert image.size == tuple(2 * round(side) for side in session.picture)
    assert image.getextrema()[3] == (0, 255), "the person stands on transparent ground"

    session.review.select(20, 44)  # 0.24 s, of which a picture is taken every 0.04 s
    drawn = []  # for the clip; the page draws the frame at its cursor in between
    draw = session.scene.draw

    def noted(frame, *rest):
        if threading.current_thread().name == "capturing":
            drawn.append(frame)
        draw(frame, *rest)

    session.scene.draw = noted
    with page.expect_download() as clip:
        page.get_by_role("button", name="GIF", exact=True).click()
    assert clip.value.suggested_filename == "walk-20-40.gif"
    assert drawn == [20, 24, 28, 32, 36, 40]
    moving = Image.open(clip.value.path())
    assert moving.n_frames == 6
    assert moving.info["duration"] == 40

    with page.expect_download() as film:
        page.get_by_role("button", name="MP4", exact=True).click()
    assert film.value.suggested_filename == "walk-20-42.mp4"
    file = tmp_path / "walk-20-42.mp4"
    film.value.save_as(file)
    assert read_header(file).rate == pytest.approx(50.0), "every second frame of 100 a second"
    session.video.open()
    session.video._fill(None)
    session.video._show(TrialVideo("walk-20-42.mp4"))
    page.wait_for_function(
        "() => Math.abs(document.querySelector('#addb-video video').duration - 0.24) < 1e-3"
    )


def test_the_next_trial_has_the_person_in_the_picture(page, until):
    session = page.session
    page.wait_for_timeout(500)
    page.mouse.move(640, 300)
    page.mouse.wheel(0, -2000)
    camera = session.client.camera
    until(lambda: np.linalg.norm(np.subtract(camera.position, camera.look_at)) < 1.0, "the camera near by")
    session.open_trial("run")
    until(lambda: np.linalg.norm(np.subtract(camera.position, camera.look_at)) > 2.0, "the whole person")
