"""Commands in a process of their own."""

import textwrap
import threading

import pytest

from addb_viewer.app.jobs.worker_process import WorkerProcess
from tests.patience import FOR_EVER_S, PATIENCE_S

TALKER = """
    import sys, time
    from addb_viewer.app.jobs.worker_process import progress_line
    if sys.argv[1] == "talk":
        print(progress_line("looking", 0.25), flush=True)
        print("{ not progress")
        print(progress_line("found", 1.0))
        print("all is well")
    elif sys.argv[1] == "fail":
        print("a warning", file=sys.stderr)
        print("addb-viewer: no trial has forces", file=sys.stderr)
        sys.exit(1)
    else:
        from addb_viewer.app.jobs.worker_process import end_in_order
        from pathlib import Path
        end_in_order()
        draft = Path("draft")
        draft.touch()
        try:
            print(progress_line("sleeping", 0.5), flush=True)
            time.sleep(FOR_EVER_S)
        finally:
            draft.unlink()
"""


class Listener:
    def __init__(self):
        self.progress, self.outcomes = [], []
        self.told, self.ended = threading.Event(), threading.Event()
        self.work = WorkerProcess(self._told, self._ended)

    def _told(self, stage, fraction):
        self.progress.append((stage, fraction))
        self.told.set()

    def _ended(self, outcome):
        self.outcomes.append(outcome)
        self.ended.set()


@pytest.fixture
def listener(tmp_path, monkeypatch):
    (tmp_path / "talker.py").write_text(textwrap.dedent(TALKER).replace("FOR_EVER_S", str(FOR_EVER_S)))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    listener = Listener()
    yield listener
    listener.work.cancel()


def test_progress_and_words_are_told_apart(listener):
    assert listener.work.start("talker", ["talk"])
    assert listener.ended.wait(PATIENCE_S)
    assert listener.progress == [("looking", 0.25), ("found", 1.0)]
    (outcome,) = listener.outcomes
    assert (outcome.succeeded, outcome.cancelled, outcome.error) == (True, False, "")
    assert outcome.said == "{ not progress\nall is well\n"
    assert not listener.work.running


def test_a_failure_brings_its_last_line(listener):
    listener.work.start("talker", ["fail"])
    assert listener.ended.wait(PATIENCE_S)
    (outcome,) = listener.outcomes
    assert not outcome.succeeded
    assert outcome.error == "no trial has forces"


def test_one_at_a_time_and_cancel_ends_it_soon_with_nothing_left_behind(listener, tmp_path):
    listener.work.start("talker", ["sleep"])
    assert listener.told.wait(PATIENCE_S)
    assert listener.work.running
    assert not listener.work.start("talker", ["talk"])
    assert (tmp_path / "draft").exists()
    listener.work.cancel()
    assert listener.ended.wait(PATIENCE_S)
    assert not (tmp_path / "draft").exists()
    (outcome,) = listener.outcomes
    assert outcome.cancelled
    assert not outcome.succeeded
    listener.ended.clear()
    assert listener.work.start("talker", ["talk"])
    assert listener.ended.wait(PATIENCE_S)
    assert not listener.outcomes[-1].cancelled
