"""Commands in a process of their own."""

import os
import textwrap
import threading

import pytest

from addb_viewer.app.jobs.job_queue import WAITING, WorkerProcess
from tests.patience import FOR_EVER_S, PATIENCE_S

TALKER = """
    import sys, time
    from addb_viewer.jobs.processes import end_in_order, print_progress
    if sys.argv[1] == "talk":
        print_progress("looking", 0.25)
        print("{ not progress")
        print_progress("found", 1.0)
        print("all is well")
    elif sys.argv[1] == "turn":
        print_progress("at work", 0.5)
        while len(sys.argv) > 2:
            time.sleep(FOR_EVER_S)
    elif sys.argv[1] == "fail":
        print("a warning", file=sys.stderr)
        print("addb-viewer: no trial has forces", file=sys.stderr)
        sys.exit(1)
    else:
        from pathlib import Path
        end_in_order()
        draft = Path("draft")
        draft.touch()
        try:
            print_progress("sleeping", 0.5)
            time.sleep(FOR_EVER_S)
        finally:
            draft.unlink()
"""


class Listener:
    def __init__(self, *turns):
        self.progress, self.outcomes = [], []
        self.told, self.ended = threading.Event(), threading.Event()
        self.work = WorkerProcess(self._told, self._ended, *turns)

    def _told(self, stage, fraction):
        self.progress.append((stage, fraction))
        self.told.set()

    def _ended(self, outcome):
        self.outcomes.append(outcome)
        self.ended.set()


@pytest.fixture
def listener(tmp_path, monkeypatch):
    (tmp_path / "talker.py").write_text(textwrap.dedent(TALKER).replace("FOR_EVER_S", str(FOR_EVER_S)))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.chdir(tmp_path)
    listener = Listener()
    yield listener
    listener.work.cancel()


def test_progress_and_words_are_told_apart(listener):
    assert listener.work.start(("talker", "talk"))
    assert listener.ended.wait(PATIENCE_S)
    assert listener.progress == [("looking", 0.25), ("found", 1.0)]
    (outcome,) = listener.outcomes
    assert (outcome.succeeded, outcome.cancelled, outcome.error) == (True, False, "")
    assert outcome.said == "{ not progress\nall is well\n"
    assert not listener.work.running


def test_a_failure_brings_its_last_line(listener):
    listener.work.start(("talker", "fail"))
    assert listener.ended.wait(PATIENCE_S)
    (outcome,) = listener.outcomes
    assert not outcome.succeeded
    assert outcome.error == "no trial has forces"


def test_one_at_a_time_and_cancel_ends_it_soon_with_nothing_left_behind(listener, tmp_path):
    listener.work.start(("talker", "sleep"))
    assert listener.told.wait(PATIENCE_S)
    assert listener.work.running
    assert not listener.work.start(("talker", "talk"))
    assert (tmp_path / "draft").exists()
    listener.work.cancel()
    assert listener.ended.wait(PATIENCE_S)
    assert not (tmp_path / "draft").exists()
    (outcome,) = listener.outcomes
    assert outcome.cancelled
    assert not outcome.succeeded
    listener.ended.clear()
    assert listener.work.start(("talker", "talk"))
    assert listener.ended.wait(PATIENCE_S)
    assert not listener.outcomes[-1].cancelled


def test_only_so_many_are_at_work_and_the_next_begins_when_one_has_ended(listener, until):
    """However that ends: here it is killed."""
    turns = threading.Semaphore(2)
    people = [Listener(turns) for _ in range(3)]
    for person in people:
        person.work.start(("talker", "turn", "for ever"), takes_turn=True)
    at_work = lambda: [p for p in people if ("at work", 0.5) in p.progress]  # noqa: E731
    until(lambda: len(at_work()) == 2 and sum(bool(p.progress) for p in people) == 3)
    (waits,) = (p for p in people if p not in at_work())
    assert waits.progress == [(WAITING, -1.0)]
    at_work()[0].work.cancel()
    until(lambda: ("at work", 0.5) in waits.progress)
    for person in people:
        person.work.cancel()


def test_who_waits_can_be_cancelled_and_holds_nobody_up(listener, until):
    turns = threading.Semaphore(1)
    first, second, third = (Listener(turns) for _ in range(3))
    first.work.start(("talker", "turn", "for ever"), takes_turn=True)
    until(lambda: first.progress)
    second.work.start(("talker", "turn"), takes_turn=True)
    until(lambda: second.progress)
    second.work.cancel()
    assert second.ended.wait(PATIENCE_S)
    assert second.outcomes[0].cancelled
    first.work.cancel()
    third.work.start(("talker", "turn"), takes_turn=True)
    assert third.ended.wait(PATIENCE_S)
    assert third.outcomes[0].succeeded
