"""Commands in a process of their own, and what waits for its turn."""

import os
import textwrap
import threading

import pytest

from addb_viewer.app.jobs import job_queue
from addb_viewer.app.jobs.job_queue import WAITING, BusyError, JobQueue, Task, WorkerProcess
from addb_viewer.jobs.processes import OwnProcess
from tests.patience import FOR_EVER_S, PATIENCE_S

TALKER = """
    import sys, time
    from addb_viewer.jobs.processes import print_progress
    from solver.common.operating_system import end_in_order
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


class Asked:
    """A workbench whose tasks end when a file is there, and what it told."""

    def __init__(self, folder, monkeypatch):
        (folder / "waits.py").write_text(
            "import pathlib, sys, time\nwhile not pathlib.Path(sys.argv[1]).exists(): time.sleep(0.01)\n"
        )
        monkeypatch.setenv("PYTHONPATH", str(folder))
        self.folder, self.ended, self.news = folder, [], threading.Condition()
        self.jobs = JobQueue(lambda progress: None, self._ended)

    def task(self, name, by="Zoë"):
        return Task(name, "starting", ("waits", str(self.folder / name)), by)

    def let_end(self, name):
        (self.folder / name).touch()

    def until_ended(self, *names):
        with self.news:
            assert self.news.wait_for(
                lambda: [task.doing for task, _ in self.ended] == list(names), PATIENCE_S
            )

    def _ended(self, task, outcome):
        with self.news:
            self.ended.append((task, outcome))
            self.news.notify_all()


@pytest.fixture
def asked(tmp_path, monkeypatch):
    made = Asked(tmp_path, monkeypatch)
    yield made
    made.jobs.close()


def test_what_is_asked_for_meanwhile_waits_its_turn_and_is_done(asked):
    first, second, third = asked.task("a"), asked.task("b", "Bo"), asked.task("c")
    assert asked.jobs.start(first) == ()
    assert asked.jobs.start(second) == (first,)
    assert asked.jobs.start(third) == (first, second)
    assert asked.jobs.progress.waiting == (second, third)
    with pytest.raises(BusyError, match="waits its turn already"):
        asked.jobs.start(asked.task("b", "Bo"))
    for name in "cba":  # in whichever order they could end
        asked.let_end(name)
    asked.until_ended("a", "b", "c")
    assert all(outcome.succeeded for _, outcome in asked.ended)
    assert not asked.jobs.busy


def test_what_waits_is_forgotten_by_the_one_who_asked_and_begins_when_the_present_is_cancelled(asked):
    for task in (asked.task("a"), asked.task("b", "Bo"), asked.task("c", "Bo")):
        asked.jobs.start(task)
    assert asked.jobs.drop("Zoë") is None
    assert asked.jobs.drop("Bo").doing == "c"
    asked.jobs.cancel()
    asked.until_ended("a")
    asked.let_end("b")
    asked.until_ended("a", "b")
    assert [outcome.cancelled for _, outcome in asked.ended] == [True, False]


def test_nothing_that_waits_begins_after_the_end(asked):
    for task in (asked.task("a"), asked.task("b")):
        asked.jobs.start(task)
    asked.jobs.close()
    asked.until_ended("a")
    assert not asked.jobs.busy


def test_what_cannot_begin_is_told_and_the_next_begins(asked, monkeypatch):
    for name in "abc":
        asked.jobs.start(asked.task(name))
    tried = []

    def begun(command, **settings):
        tried.append(command)
        if len(tried) == 1:
            raise OSError("out of memory")
        return OwnProcess(command, **settings)

    monkeypatch.setattr(job_queue, "OwnProcess", begun)
    asked.let_end("a")
    asked.let_end("c")
    asked.until_ended("a", "b", "c")
    assert "out of memory" in asked.ended[1][1].error
    assert asked.ended[2][1].succeeded
