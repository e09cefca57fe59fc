import threading
from dataclasses import replace

import pytest

from addb_viewer.app.jobs.job_queue import BusyError, Task, Workbench
from tests.patience import PATIENCE_S


class Bench:
    """A workbench whose tasks end when a file is there, and what it told."""

    def __init__(self, folder, monkeypatch):
        (folder / "waits.py").write_text(
            "import pathlib, sys, time\nwhile not pathlib.Path(sys.argv[1]).exists(): time.sleep(0.01)\n"
        )
        monkeypatch.setenv("PYTHONPATH", str(folder))
        self.folder, self.ended, self.news = folder, [], threading.Condition()
        self.bench = Workbench(lambda progress: None, self._ended)

    def task(self, name, by="Zoë"):
        return Task(name, "starting", "waits", (str(self.folder / name),), by)

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
def bench(tmp_path, monkeypatch):
    made = Bench(tmp_path, monkeypatch)
    yield made
    made.bench.close()


def test_what_is_asked_for_meanwhile_waits_its_turn_and_is_done(bench):
    first, second, third = bench.task("a"), bench.task("b", "Bo"), bench.task("c")
    assert bench.bench.start(first) == ()
    assert bench.bench.start(second) == (first,)
    assert bench.bench.start(third) == (first, second)
    assert bench.bench.progress.waiting == (second, third)
    with pytest.raises(BusyError, match="waits its turn already"):
        bench.bench.start(bench.task("b", "Bo"))
    for name in "cba":  # in whichever order they could end
        bench.let_end(name)
    bench.until_ended("a", "b", "c")
    assert all(outcome.succeeded for _, outcome in bench.ended)
    assert not bench.bench.busy


def test_what_waits_is_forgotten_by_the_one_who_asked_and_begins_when_the_present_is_cancelled(bench):
    for task in (bench.task("a"), bench.task("b", "Bo"), bench.task("c", "Bo")):
        bench.bench.start(task)
    assert bench.bench.drop("Zoë") is None
    assert bench.bench.drop("Bo").doing == "c"
    bench.bench.cancel()
    bench.until_ended("a")
    bench.let_end("b")
    bench.until_ended("a", "b")
    assert [outcome.cancelled for _, outcome in bench.ended] == [True, False]


def test_nothing_that_waits_begins_after_the_end(bench):
    for task in (bench.task("a"), bench.task("b")):
        bench.bench.start(task)
    bench.bench.close()
    bench.until_ended("a")
    assert not bench.bench.busy


def test_what_cannot_begin_is_told_and_the_next_begins(bench, monkeypatch):
    for name in "abc":
        bench.bench.start(bench.task(name))
    begin, tried = bench.bench.work.start, []

    def start(module, arguments):
        tried.append(arguments)
        if len(tried) == 1:
            raise OSError("out of memory")
        return begin(module, arguments)

    monkeypatch.setattr(bench.bench.work, "start", start)
    bench.let_end("a")
    bench.let_end("c")
    bench.until_ended("a", "b", "c")
    assert "out of memory" in bench.ended[1][1].error
    assert bench.ended[2][1].succeeded


def test_what_nobody_waits_for_gives_way_to_a_solve_and_begins_again_after_all_others(bench, until):
    in_background = replace(bench.task("figures", by=""), yields=True)
    solve, other = bench.task("solve"), bench.task("other", "Bo")
    bench.bench.start(in_background)
    assert bench.bench.start(solve) == ()  # nothing comes before it
    bench.until_ended("figures")
    assert bench.ended[0][1].cancelled
    until(lambda: bench.bench.task is solve)
    assert bench.bench.start(other) == (solve,)
    assert bench.bench.waiting == (other, in_background)
    for name in ("solve", "other", "figures"):
        bench.let_end(name)
    bench.until_ended("figures", "solve", "other", "figures")
    assert bench.ended[-1][1].succeeded


def test_it_waits_for_what_is_at_work_and_can_be_forgotten_meanwhile(bench):
    in_background = replace(bench.task("figures", by=""), yields=True)
    solve = bench.task("solve")
    bench.bench.start(solve)
    assert bench.bench.start(in_background) == (solve,)
    bench.bench.forget("figures")
    bench.let_end("solve")
    bench.until_ended("solve")
    assert not bench.bench.busy
