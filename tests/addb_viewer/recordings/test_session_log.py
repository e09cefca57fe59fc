"""The log of a session, while it grows, after a kill, and when the disk fails."""

import json
import os
import signal
import subprocess
import sys
import threading
from datetime import datetime

import pytest
from mcap.reader import make_reader

from addb_viewer.recordings.mcap_recovery import Found, readable, recover
from addb_viewer.recordings.restoring import edits_in
from addb_viewer.recordings.session_log import SessionLog
from solver.common.errors import Cancelled, ResultsError


def topics(file):
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        counts = summary.statistics.channel_message_counts
        return {channel.topic: counts[number] for number, channel in summary.channels.items()}


def test_a_session_from_its_first_trial_to_its_end(make_fit, edits, diagnosis, tmp_path):
    fit = make_fit("walk")
    with SessionLog.begin(tmp_path / "results", "Zoë") as log:
        log.capture(fit.trials[0].capture)
        for edit in edits:
            log.edit(edit)
        watched = log.watching()
        for fraction in (0.0, 0.5, 1.0):
            watched("dynamics", fraction)
        log.fit(fit)
        log.fit(fit, meshes={})
        log.diagnosis(diagnosis)
        log.note("solved", is_warning=True)
    assert log.file.parent == tmp_path / "results" / "sessions"
    told = topics(log.file)
    assert told["/walk/markers"] == 40, "what was measured is written once"
    assert told["/walk/fit-1/residual"] == told["/walk/fit-2/residual"] == 40
    assert told["/review/edits"] == 3
    assert told["/solver/progress"] == 3
    assert told["/walk/causes"] == 2
    assert told["/session/log"] == 1
    assert edits_in(log.file) == edits
    with log.file.open("rb") as stream:
        names = [a.name for a in make_reader(stream).iter_attachments()]
    assert {"settings.toml", "model.osim", "walk/review.json", "diagnosis.json"} <= set(names)


TOPICS = ("/walk/markers", "/walk/fit-1/transforms")


def test_frames_follow_the_moment_at_which_the_trial_was_opened(make_fit, tmp_path):
    before = datetime.now().timestamp()
    with SessionLog.begin(tmp_path, "Zoë") as log:
        log.capture(make_fit("walk").trials[0].capture)
        after = datetime.now().timestamp()
        log.fit(make_fit("walk"))
    with log.file.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages())
    times = {topic: [m.log_time for _, c, m in messages if c.topic == topic] for topic in TOPICS}
    assert before <= times["/walk/markers"][0] / 1e9 <= after
    assert times["/walk/markers"][-1] - times["/walk/markers"][0] == pytest.approx(1e9 * 39 / 50)
    assert times["/walk/fit-1/transforms"] == times["/walk/markers"]


KILLED = """
import os, signal, sys
from datetime import UTC, datetime
from pathlib import Path
from addb_viewer.recordings.session_log import SessionLog
from annotations.events import Edit, FlagRange

log = SessionLog.begin(Path(sys.argv[1]), "Zoë")
for number in range(1, 6):
    event = FlagRange(number, number + 5, "forceDiscrepancy")
    log.edit(Edit(number, "walk", "anna", datetime.now(UTC), event))
print(log.file, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_whatever_a_person_did_survives_a_kill(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", KILLED, tmp_path], capture_output=True, text=True, check=False
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    (file,) = (tmp_path / "sessions").iterdir()
    assert str(file) == done.stdout.strip()
    assert [edit.number for edit in edits_in(file)] == [1, 2, 3, 4, 5]
    assert not recover(file, tmp_path / "whole.mcap").is_whole
    assert topics(tmp_path / "whole.mcap") == {"/review/edits": 5}


def test_threads_may_write_at_once(edits, tmp_path):
    with SessionLog.begin(tmp_path, "Zoë") as log:
        threads = [threading.Thread(target=lambda: [log.note("x") for _ in range(50)]) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert topics(log.file) == {"/session/log": 200}


def test_progress_is_passed_on_and_may_stop_the_work(tmp_path):
    heard = []

    def stop(stage, fraction):
        heard.append((stage, fraction))
        raise Cancelled("stopped")

    with SessionLog.begin(tmp_path, "Zoë") as log, pytest.raises(Cancelled):
        log.watching(stop)("dynamics", 0.25)
    assert heard == [("dynamics", 0.25)]
    told = [json.loads(p.message.data) for p in readable(log.file, Found()) if p.message is not None]
    assert [(t["stage"], t["fraction"]) for t in told] == [("dynamics", 0.25)]


def test_a_disk_that_fails_ends_the_log_and_not_the_session(tmp_path, monkeypatch):
    log = SessionLog.begin(tmp_path, "Zoë")
    log.note("before")

    def full(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(log._mcap, "flush", full)
    log.note("during")
    assert "No space left" in log.trouble
    log.note("after")
    log.close()
    assert log._stream.closed


def test_a_place_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / "results").write_text("a file")
    with pytest.raises(ResultsError, match="the session has no log"):
        SessionLog.begin(tmp_path / "results", "Zoë")


def test_closing_twice_and_writing_afterwards_do_nothing(tmp_path):
    log = SessionLog.begin(tmp_path, "Zoë")
    log.close()
    size = log.file.stat().st_size
    log.note("late")
    log.close()
    assert log.file.stat().st_size == size
