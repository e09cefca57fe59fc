"""A Dask cluster: one that exists, or workers of this machine."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from addb_viewer.dataset.engine.engine import ATTEMPTS, Done
from addb_viewer.dataset.engine.processes import Processes
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.left_out import LeftOut
from addb_viewer.dataset.receipts import Receipt, valid_receipt, write_receipt
from addb_viewer.dataset.task import Task, read_task

LOCAL = "local"  # instead of an address: workers of this machine
_HERE = ("127.0.0.1", "localhost", "::1")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class DaskCluster:
    """Tasks as futures; what they make goes by the disk that workers and client share.

    A worker has a process for each: a fit that takes too long, or all memory, takes no worker with it.
    """

    def __init__(self, address: str, workers: int, time_out_s: float | None = None) -> None:
        """Nothing is started yet.

        Args:
            address: of a scheduler, or `LOCAL`.
            workers: of this machine, where no scheduler is named.
            time_out_s: after which a subject is given up; None: never.

        Raises:
            ReleaseError: the address is none, or leads elsewhere without TLS: Dask runs what it is sent.
        """
        self._address, self._workers, self._time_out_s = address, workers, time_out_s
        if address != LOCAL:
            _checked(address)

    def run(self, tasks: Sequence[Task], done: Done) -> None:
        """Do all tasks; see `Engine`."""
        if not tasks:
            return
        try:
            from distributed import Client, as_completed  # noqa: PLC0415 (an extra)
        except ImportError as error:
            raise ReleaseError(
                "--scheduler needs Dask: python -m pip install 'addb-viewer[dataset]'"
            ) from error
        with self._scheduler() as where, _connected(Client, where) as client:
            waiting = {}
            for task in tasks:
                task.out.parent.mkdir(parents=True, exist_ok=True)
                file = task.out.with_suffix(".task.json")
                task.write(file)
                future = client.submit(
                    do, str(file), self._time_out_s, key=task.key, retries=ATTEMPTS - 1, pure=False
                )
                waiting[future] = task
            for future in as_completed(list(waiting)):
                task = waiting.pop(future)
                done(task, _receipt_of(future, task))
                task.out.with_suffix(".task.json").unlink(missing_ok=True)
                future.release()

    @contextmanager
    def _scheduler(self) -> Iterator[Any]:
        """The address, or a cluster of this machine: processes of one thread, on 127.0.0.1, no dashboard."""
        if self._address != LOCAL:
            yield self._address
            return
        import dask  # noqa: PLC0415 (an extra)
        from distributed import LocalCluster  # noqa: PLC0415 (likewise)

        environment = {"distributed.nanny.environ": dict.fromkeys(_THREADS, "1")}
        limits = {"distributed.scheduler.allowed-failures": ATTEMPTS - 1}
        with (
            dask.config.set({**environment, **limits}),
            LocalCluster(
                n_workers=self._workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address=None,
            ) as cluster,
        ):
            yield cluster


def do(file: str, time_out_s: float | None) -> dict[str, Any] | None:
    """A worker's part: the task of a file. What it made is on the disk; why it made nothing is returned.

    Args:
        file: of the task.
        time_out_s: after which it is given up.
    """
    failed = Processes(1, time_out_s).result_of(read_task(Path(file))).failed
    return None if failed is None else asdict(failed)


@contextmanager
def _connected(client: Any, where: Any) -> Iterator[Any]:
    try:
        opened = client(where)
    except (OSError, ValueError) as error:
        raise ReleaseError(f"--scheduler {where}: no scheduler answers ({error}).") from error
    with opened:
        yield opened


def _receipt_of(future: Any, task: Task) -> Receipt:
    """The receipt that the worker left; one of ours where it died every time."""
    error = future.exception()
    if error is None:
        receipt, failed = valid_receipt(task.out, task.key), future.result()
        if receipt is not None:
            return receipt
        if failed is not None:
            return Receipt(task.key, failed=LeftOut(**failed))
        raise ReleaseError(
            f"{task.who.subject_id}: a worker did it, and {task.out} is not to be seen here. Client and "
            "workers have to share the folder of the release, under one path."
        )
    if isinstance(error, ReleaseError):
        raise error
    reason, why = "fit_failed", f"unexpected {type(error).__name__}: {error}"
    if type(error).__name__ == "KilledWorker":
        reason, why = "worker_died", f"its worker died {ATTEMPTS} times: {error}"
    lost = Receipt(task.key, failed=LeftOut("subject", task.who.subject_id, reason, why))
    write_receipt(lost, task.out)
    return lost


def _checked(address: str) -> None:
    parts = urlsplit(address)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname:
        raise ReleaseError(f"--scheduler {address}: write tcp://HOST:PORT, tls://HOST:PORT or {LOCAL}")
    if parts.scheme == "tcp" and parts.hostname not in _HERE:
        raise ReleaseError(
            f"--scheduler {address}: a scheduler on another machine needs TLS, since workers run what they "
            "are sent. Use tls:// and Dask's settings for its certificates."
        )
