"""Recordings and the session's log, asked for in a browser, made by the real worker."""

import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from mcap.reader import make_reader

from addb_viewer.app.app import ReviewApp, start
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import library_of
from addb_viewer.jobs.review_store import open_log
from addb_viewer.recordings.mcap_recovery import recover
from addb_viewer.recordings.restoring import edits_in
from solver.capture.subject.subject import open_subject
from solver.common.errors import ResultsError, SolverError
from solver.fitting.pipeline import solve
from solver.fitting.results.store import save_fit
from solver.fitting.settings import Settings
from solver.simulate.demo import write_demo_subject
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.test_app import write_subject
from tests.patience import PATIENCE_S


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("record") / "demo"
    folder.mkdir()
    write_demo_subject(folder, np.random.default_rng(1), trials=("static", "squat"))
    save_fit(solve(open_subject(folder), Settings()), folder / "results")
    return folder


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


def test_a_log_begun_in_one_browser_is_everybodys_and_holds_what_happened(app, enter, folder):
    one, other = enter(app), enter(app)
    one.press("Log the session, or no longer")
    other.until(lambda: "<b>Writing</b>" in other.html())
    file = app.subjects.loaded[0].log.file
    assert file.parent == folder / "results" / "sessions"
    other.put("Go to", "10:20")
    other.until(lambda: other.session.review.chosen == (10, 20))
    other.press("Flag: force wrong")
    with open_log(folder) as log:
        other.until(log.history, "the flag")
    other.press("Log the session, or no longer")
    one.until(lambda: "<b>Writing</b>" not in one.html() and file.name in one.html())
    counts = topics(file)
    assert counts["/squat/markers"] == counts["/squat/fit-1/transforms"] == one.session.replay.frames
    with open_log(folder) as log:
        assert edits_in(file) == log.history()


def test_a_log_on_the_command_line_survives_a_kill(tmp_path):
    """Two runs: what the first has logged is not written over by the second."""
    subject, wished = write_subject(tmp_path / "S1"), tmp_path / "day.mcap"
    for k, file in enumerate((wished, tmp_path / "day 2.mcap")):
        process = subprocess.Popen(
            [sys.executable, "-m", "addb_viewer", "open", subject, "--port", "0", "--log", wished],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={name: value for name, value in os.environ.items() if name != "DISPLAY"},
        )
        try:
            port = int(re.search(r":(\d+) ", process.stdout.readline())[1])
            assert str(file) in process.stdout.readline()
            browser = PaperBrowser(port)
            browser.until(lambda browser=browser: "data-addb-curves" in browser.html(), "a trial")
            for j in range(5):
                note = f"edit {5 * k + j}"
                browser.put("Note", note)
                browser.put("Go to", f"{j}:{j + 5}")
                browser.press("Flag: other")
                browser.until(lambda browser=browser, note=note: f"({note})" in browser.html(), note)
            browser.until(lambda file=file, k=k: len(edits_in(file)) == 5 * k + 5, "the log")
        finally:
            process.send_signal(signal.SIGKILL)
            process.wait()
            process.stdout.close()
            browser.close()
        whole = tmp_path / f"whole-{k}.mcap"
        assert not recover(file, whole).is_whole
        assert {"/first/markers", "/review/edits"} <= set(topics(whole))
        with open_log(subject) as log:
            assert edits_in(whole) == log.history()


def test_every_subject_of_a_root_has_a_log_of_its_own(tmp_path, enter):
    for name in ("Ann", "Bob"):
        write_subject(tmp_path / name)
    app = start(tmp_path, port=0, log=tmp_path / "day.mcap")
    try:
        browser = enter(app)
        there = browser.session.shared.name
        elsewhere = "Bob" if there == "Ann" else "Ann"
        browser.session.notices.do("Opening", lambda: browser.session.open(elsewhere, None))
        browser.until(lambda: browser.session.shared.name == elsewhere)
        logs = {shared.name: shared.log.file.name for shared in app.subjects.loaded}
        assert logs == {"Ann": "day Ann.mcap", "Bob": "day Bob.mcap"}
    finally:
        app.close()
    assert "/first/markers" in topics(tmp_path / f"day {there}.mcap")


def test_a_log_in_a_folder_that_is_not_there_is_refused_at_once(tmp_path):
    with pytest.raises(ResultsError, match="nowhere"):
        start(write_subject(tmp_path / "S1"), port=0, log=tmp_path / "nowhere" / "day.mcap")


def test_a_log_is_whole_when_the_program_is_ended_kindly(tmp_path):
    subject, file = write_subject(tmp_path / "S1"), tmp_path / "day.mcap"
    process = subprocess.Popen(
        [sys.executable, "-m", "addb_viewer", "open", subject, "--port", "0", "--log", file],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "DISPLAY"},
    )
    try:
        browser = PaperBrowser(int(re.search(r":(\d+) ", process.stdout.readline())[1]))
        browser.until(lambda: "data-addb-curves" in browser.html(), "a trial")
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
    browser.close()
    assert recover(file, tmp_path / "copy.mcap").is_whole
    assert "/first/markers" in topics(file)


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
