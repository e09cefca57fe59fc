"""A video beside the scene in a real page: the picture that belongs to the cursor is seen."""

import shutil
from pathlib import Path

import pytest

from addb_viewer.app.security import file_parts
from addb_viewer.app.subjects.videos import TrialVideo, kept_video

pytestmark = pytest.mark.browser

BRIGHTNESS = Path(__file__).with_name(
    "brightness.mp4"
)  # VP9; every picture tells its number by its brightness
RATE, STEP = 25, 5  # [Hz] of it; from one picture to the next

SEEN = """() => {
    const film = document.querySelector("#addb-video video");
    if (film.seeking || film.readyState < 2) return null;
    const pen = Object.assign(document.createElement("canvas"), { width: 8, height: 8 }).getContext("2d");
    pen.drawImage(film, 0, 0, 8, 8);
    return pen.getImageData(4, 4, 1, 1).data[0];
}"""


@pytest.mark.slow
def test_the_picture_of_the_cursor_is_seen_and_the_clock_is_kept(tmp_path, page, until, monkeypatch):
    monkeypatch.setattr(file_parts, "MOST_BYTES", 2000)  # so that it comes in several parts
    session = page.session
    shutil.copyfile(BRIGHTNESS, tmp_path / "walk.mp4")
    (tmp_path / "cut.mp4").write_bytes(BRIGHTNESS.read_bytes()[:500])
    (tmp_path / "old.avi").write_bytes(b"RIFF")
    session.open_trial("walk")
    page.get_by_role("tab", name="View", exact=True).click()
    page.get_by_text("Video", exact=True).first.click()

    def choose(name):
        page.get_by_text("File", exact=True).first.click()
        page.get_by_role("option", name=name).click()

    choose("old.avi")
    page.get_by_text("ffmpeg -i").first.wait_for()
    assert kept_video(tmp_path, "walk") is None
    assert session.video.which.value == "none"
    choose("cut.mp4")
    page.locator("#addb-video figcaption").get_by_text(
        "this browser does not play it. To convert it: ffmpeg"
    ).wait_for()
    choose("walk.mp4")
    page.locator("#addb-video figcaption").get_by_text("walk.mp4").wait_for()

    def picture():
        seen = page.evaluate(SEEN)
        return None if seen is None else round(seen / STEP)

    def shows(seconds):
        until(lambda: picture() == int(seconds * RATE + 1e-6), f"the picture at {seconds} s, not {picture()}")

    for frame in (0, 100, 37, 4, 3, 150):  # 100 frames a second, so that every fourth begins a picture
        session.seek(frame)
        shows(frame / 100)
    for label, value in (("Offset [s]", "0.5"), ("Rate", "0.5")):
        box = page.get_by_text(label, exact=True).first.locator("xpath=following::input[1]")
        box.fill(value)
        box.press("Enter")
    shows(0.5 + 0.5 * 1.5)
    assert kept_video(tmp_path, "walk") == TrialVideo("walk.mp4", 0.5, 0.5)

    session.seek(0)
    shows(0.5)
    page.keyboard.press("Space")
    until(lambda: picture() is not None and picture() > 0.6 * RATE, "the video to play along")
    page.keyboard.press("Space")
    until(lambda: not session.playing)
    shows(0.5 + 0.5 * session.frame / 100)

    session.open_trial("run")
    page.locator("#addb-video").wait_for(state="hidden")
    session.open_trial("walk")
    shows(0.5)
