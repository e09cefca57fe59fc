"""Killed at any moment: what a reviewer has seen acknowledged is in the store, and the store is whole."""

import os
import re
import signal
import sqlite3
import subprocess
import sys

import numpy as np
import pytest

from addb_viewer.jobs.review_store import FILE, open_log
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.test_app import write_subject

EDITS, MOST = 60, 40  # in all; at most between two kills


@pytest.fixture
def subject(tmp_path):
    return write_subject(tmp_path / "S1")


def serving(folder):
    process = subprocess.Popen(
        [sys.executable, "-m", "addb_viewer", "open", str(folder), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={name: value for name, value in os.environ.items() if name != "DISPLAY"},
        start_new_session=True,
    )
    port = int(re.search(r":(\d+) ", process.stdout.readline())[1])
    return process, port


@pytest.mark.slow
def test_nothing_acknowledged_is_lost_and_the_database_is_sound(subject):
    rng = np.random.default_rng(0)
    seen = 0
    while seen < EDITS:
        process, port = serving(subject)
        browser = PaperBrowser(port)
        try:
            browser.until(lambda browser=browser: browser.trial, "a trial")
            for k in range(rng.integers(2, MOST)):
                note = f"edit {seen + 1}"
                browser.put("Note", note)
                start = k % 40
                browser.select(start, start + 5)
                browser.press_in_palette("Flag: other")
                browser.until(lambda browser=browser, note=note: f"({note})" in browser.html(), note)
                seen += 1
            browser.press("Flag: force wrong")  # and one that nobody waits for
        finally:
            process.send_signal(signal.SIGKILL)
            process.wait()
            process.stdout.close()
            browser.close()
        with sqlite3.connect(subject / FILE) as database:
            assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        with open_log(subject) as log:
            notes = [edit.event.note for edit in log.history("first")]
            assert set(notes) >= {f"edit {n}" for n in range(1, seen + 1)}
            log.review("first", ("calcn_r", "calcn_l"))
