"""The scene in a real page: names of plates, measuring by clicks, bones that show torques."""

import io
import threading

import numpy as np
import pytest
from PIL import Image

from addb_viewer.app.scene.camera import eye_of
from addb_viewer.app.scene.legend import BY_RESIDUAL
from addb_viewer.app.subjects.videos import TrialVideo

pytestmark = pytest.mark.browser

NEAR_PX = 8  # a frame is 3 pixels wide here
SHOWN = "() => document.querySelector('#addb-video video').videoWidth > 0"
LASTS = """() => new Promise((done) => {
    const film = document.querySelector("#addb-video video");
    if (Number.isFinite(film.duration)) return done(film.duration);
    film.ondurationchange = () => Number.isFinite(film.duration) && done(film.duration);
    film.currentTime = 1e9; // a recorded WebM knows how long it lasts once its end was looked for
})"""


def test_while_it_plays_markers_and_bones_are_of_one_frame(page, until):
    """The head's marker stands over the box of the pelvis: as many pixels aside as on frames at rest."""
    session, canvas = page.session, page.locator("#root canvas").first.bounding_box()
    for option in ("forces", "required", "residual", "total", "model_markers"):
        setattr(session.scene.options, option, False)
    session.scene.follow(False, 0)

    def apart():
        picture = np.asarray(Image.open(io.BytesIO(page.screenshot(clip=canvas))).convert("L"), int)
        drawn, middle, horizon = picture < 200, len(picture) // 3, round(0.525 * len(picture))
        head, box = (np.nonzero(part)[1].mean() for part in (drawn[:middle], drawn[middle:horizon]))
        return head - box

    session.view("Side")
    rest = []
    for frame in range(40, 121, 20):
        session.playback.seek(frame)
        page.wait_for_timeout(1500)
        rest.append(apart())
    for _ in range(2):
        session.playback.faster()  # from rest: at real time, then twice as fast
    session.playback.loop(40, 120)
    page.wait_for_timeout(500)
    seen = [apart() for _ in range(8)]
    session.playback.pause()
    assert min(rest) - NEAR_PX < min(seen) <= max(seen) < max(rest) + NEAR_PX, (rest, seen)


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

    def named_at(point, aside):
        (x, y), tip = seen(point), page.locator("#addb-pointed")
        page.mouse.move(canvas["x"] + x + aside, canvas["y"] + y)
        page.wait_for_timeout(500)
        return tip.text_content()

    until(lambda: named_at([0, 1.7, 0], 2) == "HEAD", "the marker's name")
    assert not named_at([0, 1.7, 0], 60)

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
    page.get_by_role("option", name=BY_RESIDUAL).click()
    until(lambda: session.scene.options.tint == BY_RESIDUAL)
    page.get_by_text("2 times its limit").wait_for()


@pytest.mark.slow
def test_a_picture_and_a_film_have_the_frames_that_were_asked_for(tmp_path, page):
    session = page.session
    page.get_by_role("tab", name="View", exact=True).click()
    session.seek(50)
    with page.expect_download() as picture:
        page.get_by_role("button", name="PNG", exact=True).click()
    assert picture.value.suggested_filename == "walk-50.png"
    image = Image.open(picture.value.path())
    assert image.size == tuple(2 * round(side) for side in session.picture)
    assert image.getextrema()[3] == (0, 255), "the person stands on transparent ground"

    session.review.select(20, 44)
    drawn = []  # for the film; the page draws the frame at its cursor in between
    draw = session.scene.draw

    def noted(frame, *rest):
        if threading.current_thread().name == "capturing":
            drawn.append(frame)
        draw(frame, *rest)

    session.scene.draw = noted
    with page.expect_download() as film:
        page.get_by_role("button", name="Film", exact=True).click()
    assert drawn == list(range(20, 44, 2)), "every second frame of 100 a second"
    name = film.value.suggested_filename
    assert name in ("walk-20-42.mp4", "walk-20-42.webm")
    film.value.save_as(tmp_path / name)
    session.video.open()
    session.video._fill(None)
    session.video._show(TrialVideo(name))
    page.wait_for_function(SHOWN)
    lasts = page.evaluate(LASTS)
    assert 0.24 < lasts < 4.0, "all frames at their moments, and the first and the last one a little longer"


def test_the_next_trial_has_the_person_in_the_picture(page, until):
    session = page.session
    page.wait_for_timeout(500)
    page.mouse.move(640, 300)
    page.mouse.wheel(0, -2000)
    camera = session.client.camera
    until(lambda: np.linalg.norm(np.subtract(camera.position, camera.look_at)) < 1.0, "the camera near by")
    session.open_trial("run")
    until(lambda: np.linalg.norm(np.subtract(camera.position, camera.look_at)) > 2.0, "the whole person")
