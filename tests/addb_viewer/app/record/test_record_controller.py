"""Recordings, asked for in a browser, made by the real worker."""

import shutil

import pytest
from mcap.reader import make_reader

from addb_viewer.app.app import ReviewApp, start
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import library_of
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import SolverError
from tests.addb_viewer.app.test_app import write_subject


@pytest.fixture
def folder(fitted_squat, tmp_path):
    return shutil.copytree(fitted_squat, tmp_path / "demo")


@pytest.fixture
def app(folder):
    trials = TrialQueue.of(library_of(open_subject(folder)))
    app = ReviewApp(open_server(port=0), trials, login="Zoë")
    yield app
    app.close()


def topics(file):
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    counts = summary.statistics.channel_message_counts
    return {channel.topic: counts[number] for number, channel in summary.channels.items()}


@pytest.mark.slow
def test_the_fit_is_written_as_a_report_and_for_both_viewers_and_their_folder_is_shown(app, enter, folder):
    browser = enter(app)
    recordings = folder / "results" / "recordings"
    for label, kind in (
        ("Write a report of the fit", ".html"),
        ("Write the form on one page", " on one page.html"),
        ("Record the fit for rerun", ".rrd"),
        ("Record the fit as MCAP", ".mcap"),
    ):
        browser.press(label)
        file = recordings / f"demo{kind}"
        browser.until(lambda file=file: browser.told(f"{file.name}: listed"), file.name)
        assert file.stat().st_size > (10_000 if "one page" in kind else 100_000)
        browser.until(lambda file=file: file.name in browser.html(), "the list")
    page = (recordings / "demo.html").read_text(encoding="utf-8")
    assert "frames are usable" in page
    assert 'id="scene-data"' in page
    form = (recordings / "demo on one page.html").read_text(encoding="utf-8")
    assert "checked by" in form
    assert "scene-data" not in form
    assert "/squat/transforms" in topics(recordings / "demo.mcap")
    browser.until(lambda: str(recordings) in browser.html())


def test_nothing_to_record_is_told(tmp_path, make_app, make_replay, enter):
    app = make_app(tmp_path, [make_replay()], login="Zoë")
    try:
        browser = enter(app)
        browser.press("Record the fit for rerun")
        browser.until(lambda: browser.told("nothing has been fitted yet"))
    finally:
        app.close()


def test_a_link_out_of_the_folder_is_told_and_neither_listed_nor_sent(tmp_path, enter):
    secret = tmp_path / "secret.html"
    secret.write_text("secret")
    folder = write_subject(tmp_path / "S1")
    app = start(folder, port=0)
    try:
        recordings = folder / "results" / "recordings"
        recordings.mkdir(parents=True)
        (recordings / "mine.html").write_text("mine")
        (recordings / "link.html").symlink_to(secret)
        (recordings / "also mine.html").symlink_to("mine.html")
        browser = enter(app)
        browser.until(lambda: "link.html leads out of the folder" in browser.html())
        tab = browser.session.recording
        assert sorted(tab._listed) == ["also mine.html", "mine.html"]
        (recordings / "mine.html").unlink()
        (recordings / "mine.html").symlink_to(secret)  # after it was listed
        tab.panel.which.value = "mine.html"
        with pytest.raises(SolverError, match="not there any more"):
            tab.download()
    finally:
        app.close()
