"""The same tasks by Dask, where it is installed."""

import pytest

from addb_viewer.dataset.engine.dask_cluster import LOCAL, DaskCluster
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.options import BuildOptions
from addb_viewer.dataset.release_subject import ReleaseSubject
from addb_viewer.dataset.task import Task


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("tcp://10.0.0.7:8786", "needs TLS"),
        ("http://127.0.0.1:8786", "write tcp://HOST:PORT"),
        ("8786", "write tcp://HOST:PORT"),
    ],
)
def test_an_address_that_is_none_or_not_safe_is_refused_at_once(address, why):
    with pytest.raises(ReleaseError, match=why):
        DaskCluster(address, 1)


def test_addresses_here_and_with_tls_are_taken():
    for address in ("tcp://127.0.0.1:8786", "tcp://localhost:8786", "tls://10.0.0.7:8786", LOCAL):
        DaskCluster(address, 1)


def test_without_a_task_no_cluster_is_started():
    DaskCluster("tcp://127.0.0.1:1", 1).run([], lambda *_: pytest.fail("nothing was to be done"))


def test_an_error_of_the_data_is_a_receipt(tmp_path):
    pytest.importorskip("distributed")
    who = ReleaseSubject("Lab", "P", "nowhere", None, "CC0-1.0", "public", None, None, ())
    place, out = tmp_path / "nowhere", tmp_path / "work" / "k"
    task, told = Task("k", place, who, ("walk",), BuildOptions(), out, 100), []
    DaskCluster(LOCAL, 1).run([task], lambda _, receipt: told.append(receipt))
    (receipt,) = told
    assert receipt.failed.reason == "fit_failed"
    assert "nowhere: no folder of that name" in receipt.failed.detail
