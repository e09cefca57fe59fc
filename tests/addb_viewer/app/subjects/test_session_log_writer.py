"""What the session's log says, read back from its file."""

import json
from dataclasses import replace

import pytest
from mcap.reader import make_reader

from addb_viewer.app.jobs.job_queue import Task, TaskProgress
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.session_log_writer import SessionLogWriter
from addb_viewer.jobs.kept_diagnosis import keep
from addb_viewer.jobs.review_store import open_log
from addb_viewer.recordings.restoring import edits_in
from addb_viewer.recordings.session_log import SessionLog
from annotations.events import FlagRange, Undo
from solver.fitting.results.store import save_fit

TASK = Task("Solving", "starting", "some.module", (), "Zoë")


@pytest.fixture
def library(small_fit):
    save_fit(small_fit, small_fit.subject.folder / "results")
    return library_of(small_fit.subject)


@pytest.fixture
def review(library):
    with open_log(library.subject.folder) as log:
        yield log


@pytest.fixture
def failures():
    return []


@pytest.fixture
def live(library, review, failures):
    live = SessionLogWriter(SessionLog.begin(library.results, "subject"), review.since, failures.append)
    yield live
    live.close()


def messages(live):
    """(topic, content of JSON or text of a log line) in the order in which they were written."""
    live.close()
    with live.file.open("rb") as stream:
        found = list(make_reader(stream).iter_messages(log_time_order=False))
    return [
        (channel.topic, json.loads(message.data) if channel.message_encoding == "json" else message.data)
        for _, channel, message in found
    ]


def test_edits_from_before_and_after_are_each_in_it_once(live, review, library):
    trial = library.trials[0]
    first = review.append(trial, FlagRange(3, 9, "forceDiscrepancy"), "Zoë")
    live.edited()
    review.append(trial, Undo(first), "Zoë")
    live.edited()
    live.edited()
    live.close()
    assert edits_in(live.file) == review.history()


def test_every_trial_of_every_fit_is_written_once_and_keeps_its_number(live, small_fit, library):
    trial = library.trials[0]
    live.opened(trial, library)
    live.opened(trial, library)
    save_fit(replace(small_fit, mass_kg=small_fit.mass_kg + 1), library.results)
    later = library_of(small_fit.subject)
    live.opened(trial, later, library)
    live.opened(trial, library)
    said = messages(live)
    frames = small_fit.trials[0].motion.frames
    topics = [topic for topic, _ in said]
    assert topics.count(f"/{trial}/fit-1/transforms") == frames
    assert topics.count(f"/{trial}/fit-2/transforms") == frames
    assert topics.count(f"/{trial}/markers") == small_fit.trials[0].capture.markers.frames
    shown = [data for topic, data in said if topic == "/session/log"]
    assert [b"fit-1" in shown[0], b"fit-2" in shown[1], b"fit-1" in shown[2]] == [True] * 3


def test_a_trial_without_a_fit_is_logged_as_measured(live, small_fit, library):
    bare = replace(library, fit=None, captures={"walk": small_fit.trials[0].capture})
    live.opened("walk", bare)
    topics = {topic for topic, _ in messages(live)}
    assert "/walk/markers" in topics
    assert not any("fit-" in topic for topic in topics)


def test_progress_outcome_and_diagnosis_are_in_it(live, library, figures, effect):
    for seconds, fraction in ((1.0, 0.2), (4.5, 0.7)):
        live.progressed(TaskProgress(TASK, "trajectory fit", fraction, seconds))
    live.progressed(TaskProgress(TASK, "starting", None, 5.0))
    live.ended(TASK, Outcome(False, False, "", "the model broke"))
    live.opened(library.trials[0], library)
    keep(figures(effect("clock_offset", "all", ((0, 3),), offset_s=0.01)), {}, library.results)
    live.diagnosed(library.results)
    said = messages(live)
    steps = [content for topic, content in said if topic == "/solver/progress"]
    assert [(s["stage"], s["fraction"]) for s in steps] == [("trajectory fit", 0.2), ("trajectory fit", 0.7)]
    assert [s["seconds"] for s in steps] == pytest.approx([1.0, 4.5], abs=0.01)
    assert any(
        b"Solving failed: the model broke (for Zo\xc3\xab)" in d for t, d in said if t == "/session/log"
    )
    assert any(topic == f"/{library.trials[0]}/causes" for topic, _ in said)


def test_what_cannot_be_written_is_told_once_and_the_session_goes_on(live, library, failures):
    live.opened("walk", replace(library, fit=None))  # its files are not there
    live.opened("no/forces", replace(library, fit=None))
    live.note("still here")
    assert any(b"still here" in data for topic, data in messages(live) if topic == "/session/log")
    (failure,) = failures
    assert "markers.trc" in str(failure)
