import threading
from dataclasses import replace

import pytest

from addb_viewer.app.jobs import job_queue
from addb_viewer.app.jobs.job_queue import BusyError, JobQueue, Task
from addb_viewer.jobs.processes import OwnProcess
from tests.patience import PATIENCE_S


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


def test_what_nobody_waits_for_gives_way_to_a_solve_and_begins_again_after_all_others(asked, until):
    in_background = replace(asked.task("figures", by=""), yields=True)
    solve, other = asked.task("solve"), asked.task("other", "Bo")
    asked.jobs.start(in_background)
    assert asked.jobs.start(solve) == ()  # nothing comes before it
    asked.until_ended("figures")
    assert asked.ended[0][1].cancelled
    until(lambda: asked.jobs.task is solve)
    assert asked.jobs.start(other) == (solve,)
    assert asked.jobs.waiting == (other, in_background)
    for name in ("solve", "other", "figures"):
        asked.let_end(name)
    asked.until_ended("figures", "solve", "other", "figures")
    assert asked.ended[-1][1].succeeded


def test_it_waits_for_what_is_at_work_and_can_be_forgotten_meanwhile(asked):
    in_background = replace(asked.task("figures", by=""), yields=True)
    solve = asked.task("solve")
    asked.jobs.start(solve)
    assert asked.jobs.start(in_background) == (solve,)
    asked.jobs.forget("figures")
    asked.let_end("solve")
    asked.until_ended("solve")
    assert not asked.jobs.busy
