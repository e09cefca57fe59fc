"""A Dask cluster: one that exists, or workers of this machine."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

from addb_viewer.jobs.processes import THREADS, Item, Processes, Result, Start
from solver.common.errors import SolverError

LOCAL = "local"  # instead of an address: workers of this machine
ATTEMPTS = 3  # of an item whose worker dies
_HERE = ("127.0.0.1", "localhost", "::1")


class SchedulerError(SolverError):
    """A scheduler that cannot be used."""


class DaskCluster:
    """Items as futures.

    A worker starts a process for each: one that takes too long, or all memory, takes no worker with it.
    """

    def __init__(self, address: str, workers: int) -> None:
        """Nothing is started yet.

        Args:
            address: of a scheduler, or `LOCAL`.
            workers: of this machine, where no scheduler is named.

        Raises:
            SchedulerError: the address is none, or leads elsewhere without TLS: Dask runs what it is sent.
        """
        self._address, self._workers = address, workers
        if address != LOCAL:
            _check(address)

    def run(
        self,
        items: Sequence[Item],
        do: Callable[[Item, Start], Result],
        done: Callable[[Item, Result | None], None],
    ) -> None:
        """As for `Engine`; items, results and `do` go over the network.

        Raises:
            SchedulerError: Dask is not installed, or no scheduler answers.
        """
        if not items:
            return
        try:
            from distributed import Client, as_completed  # noqa: PLC0415 (an extra)
        except ImportError as error:
            raise SchedulerError(
                "--scheduler needs Dask: python -m pip install 'addb-viewer[dataset]'"
            ) from error
        with self._scheduler() as where, _connected(Client, where) as client:
            waiting = {
                client.submit(_done_there, do, item, retries=ATTEMPTS - 1, pure=False): item for item in items
            }
            for future in as_completed(list(waiting)):
                wrong = future.exception()
                if wrong is not None and type(wrong).__name__ != "KilledWorker":
                    raise wrong
                done(waiting.pop(future), None if wrong is not None else future.result())
                future.release()

    @contextmanager
    def _scheduler(self) -> Iterator[Any]:
        """The address, or a cluster of this machine: processes of one thread, on 127.0.0.1, no dashboard."""
        if self._address != LOCAL:
            yield self._address
            return
        import dask  # noqa: PLC0415 (an extra)
        from distributed import LocalCluster  # noqa: PLC0415 (likewise)

        environment = {"distributed.nanny.environ": dict.fromkeys(THREADS, "1")}
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


def _done_there(do: Callable[[Item, Start], Result], item: Item) -> Result:
    """A worker's part."""
    return do(item, Processes(1).start)


@contextmanager
def _connected(client: Any, where: Any) -> Iterator[Any]:
    try:
        opened = client(where)
    except (OSError, ValueError) as error:
        raise SchedulerError(f"--scheduler {where}: no scheduler answers ({error}).") from error
    with opened:
        yield opened


def _check(address: str) -> None:
    parts = urlsplit(address)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname:
        raise SchedulerError(f"--scheduler {address}: write tcp://HOST:PORT, tls://HOST:PORT or {LOCAL}")
    if parts.scheme == "tcp" and parts.hostname not in _HERE:
        raise SchedulerError(
            f"--scheduler {address}: a scheduler on another machine needs TLS, since workers run what they "
            "are sent. Use tls:// and Dask's settings for its certificates."
        )
