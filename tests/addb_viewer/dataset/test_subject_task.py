"""Subjects in processes of their own, of this machine and by Dask where it is installed; some of them die."""

import sys
import threading
from contextlib import suppress
from functools import partial
from pathlib import Path

import psutil
import pytest

from addb_viewer.dataset.build_task import Task, read_task, valid_receipt
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import BuildOptions, ReleaseSubject
from addb_viewer.dataset.subject_task import done_apart
from addb_viewer.jobs.dask_cluster import LOCAL, DaskCluster, SchedulerError
from addb_viewer.jobs.processes import Processes


def run(workers, tasks, done, **limit):
    Processes(workers).run(tasks, partial(done_apart, **limit), done)


def task(folder, name="nowhere"):
    who = ReleaseSubject("Lab", "P", name, None, "CC0-1.0", "public", None, None, ("licence",))
    return Task("k" * 8 + name, folder / name, who, ("walk",), BuildOptions(), folder / "work" / name, 100)


def test_a_task_comes_through_its_file(tmp_path):
    one = task(tmp_path)
    one.write(tmp_path / "task.json")
    assert read_task(tmp_path / "task.json") == one


def test_an_error_of_the_data_is_a_receipt(tmp_path):
    one, told = task(tmp_path), []
    run(1, [one], lambda task, receipt: told.append((task, receipt)))
    ((_, receipt),) = told
    assert receipt.failed.reason == "fit_failed"
    assert "nowhere: no folder of that name" in receipt.failed.detail
    assert valid_receipt(one.out, one.key).failed == receipt.failed
    assert valid_receipt(one.out, "another key") is None
    assert not list((tmp_path / "work").glob("*.json"))


def shell(tmp_path, monkeypatch, line):
    """A program in Python's place that notes each start."""
    program = tmp_path / "python"
    program.write_text(f'#!/bin/sh\necho "$3" >> {tmp_path}/starts\n{line}\n', encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(program))
    return lambda: (tmp_path / "starts").read_text(encoding="utf-8").splitlines()


def test_a_worker_that_dies_three_times_is_told_and_takes_no_other_with_it(tmp_path, monkeypatch):
    starts = shell(tmp_path, monkeypatch, "kill -9 $$")
    told = {}
    tasks = [task(tmp_path, name) for name in ("one", "other")]
    run(2, tasks, lambda task, receipt: told.update({task.who.folder: receipt.failed}))
    assert {failed.reason for failed in told.values()} == {"worker_died"}
    assert "SIGKILL, 3 times" in told["one"].detail
    assert len(starts()) == 6


def test_a_worker_that_takes_too_long_is_given_up_and_tried_again_by_the_next_build(tmp_path, monkeypatch):
    starts = shell(tmp_path, monkeypatch, "exec sleep 60")
    one, told = task(tmp_path, "one"), []
    run(1, [one], lambda _, receipt: told.append(receipt.failed), time_out_s=0.1)
    ((reason, detail),) = [(failed.reason, failed.detail) for failed in told]
    assert (reason, detail) == ("timed_out", "not done after 0.1 s")
    assert len(starts()) == 1
    assert valid_receipt(one.out, one.key) is None
    assert not list((tmp_path / "work").glob("*.json"))


def test_an_error_that_nobody_expected_is_told_once_and_takes_no_other_with_it(tmp_path, monkeypatch):
    starts = shell(tmp_path, monkeypatch, 'echo "Traceback" >&2; echo "KeyError: 3" >&2; exit 1')
    told = []
    tasks = [task(tmp_path, name) for name in ("one", "other")]
    run(1, tasks, lambda _, receipt: told.append(receipt.failed))
    assert [(failed.reason, failed.detail) for failed in told] == [
        ("fit_failed", "unexpected KeyError: 3")
    ] * 2
    assert len(starts()) == 2


def test_a_disk_that_fails_stops_the_build_with_its_own_words(tmp_path, monkeypatch):
    starts = shell(tmp_path, monkeypatch, 'echo "/mnt/x: No space left on device" >&2; exit 75')
    with pytest.raises(ReleaseError, match=r"Lab/one: /mnt/x: No space left on device"):
        run(1, [task(tmp_path, "one")], lambda *_: None)
    assert len(starts()) == 3
    assert not Path(tmp_path / "work" / "one" / "receipt.json").exists()


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("tcp://10.0.0.7:8786", "needs TLS"),
        ("http://127.0.0.1:8786", "write tcp://HOST:PORT"),
        ("8786", "write tcp://HOST:PORT"),
    ],
)
def test_an_address_that_is_none_or_not_safe_is_refused_at_once(address, why):
    with pytest.raises(SchedulerError, match=why):
        DaskCluster(address, 1)


def test_addresses_here_and_with_tls_are_taken():
    for address in ("tcp://127.0.0.1:8786", "tcp://localhost:8786", "tls://10.0.0.7:8786", LOCAL):
        DaskCluster(address, 1)


def test_without_a_task_no_cluster_is_started():
    DaskCluster("tcp://127.0.0.1:1", 1).run([], pytest.fail, pytest.fail)


@pytest.fixture
def nowhere(tmp_path):
    """A task that fails after some seconds, since there is no such folder."""
    pytest.importorskip("distributed")
    who = ReleaseSubject("Lab", "P", "nowhere", None, "CC0-1.0", "public", None, None, ())
    return Task("k", tmp_path / "nowhere", who, ("walk",), BuildOptions(), tmp_path / "work" / "k", 100)


def failed_of(task, time_out_s=None):
    told = []
    do = partial(done_apart, time_out_s=time_out_s)
    DaskCluster(LOCAL, 1).run([task], do, lambda _, receipt: told.append(receipt.failed))
    (failed,) = told
    return failed.reason, failed.detail


def test_an_error_of_the_data_is_a_receipt_of_a_cluster(nowhere):
    reason, detail = failed_of(nowhere)
    assert reason == "fit_failed"
    assert "nowhere: no folder of that name" in detail
    assert valid_receipt(nowhere.out, nowhere.key).failed.detail == detail


def test_a_task_that_takes_too_long_is_given_up_and_tried_again_by_the_next_build(nowhere):
    assert failed_of(nowhere, 0.02) == ("timed_out", "not done after 0.02 s")
    assert valid_receipt(nowhere.out, nowhere.key) is None


def test_a_task_that_is_killed_again_and_again_ends_alone(nowhere):
    """As by a system without memory: its process goes, Dask's worker stays."""
    stop = threading.Event()

    def kill():
        while not stop.wait(0.05):
            for child in psutil.Process().children(recursive=True):
                with suppress(psutil.Error):
                    if "addb_viewer.dataset.subject_task" in child.cmdline():
                        child.kill()

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        reason, detail = failed_of(nowhere)
    finally:
        stop.set()
        killer.join()
    assert reason == "worker_died"
    assert detail.startswith("SIGKILL, 3 times; it had ")
