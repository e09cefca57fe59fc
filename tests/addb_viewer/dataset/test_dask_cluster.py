"""The same tasks by Dask, where it is installed."""

import threading
from contextlib import suppress
from functools import partial

import psutil
import pytest

from addb_viewer.dataset.release_subject import BuildOptions, ReleaseSubject
from addb_viewer.dataset.subject_task import done_apart
from addb_viewer.dataset.task import Task, valid_receipt
from addb_viewer.jobs.dask_cluster import LOCAL, DaskCluster, SchedulerError


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


def test_an_error_of_the_data_is_a_receipt(nowhere):
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
