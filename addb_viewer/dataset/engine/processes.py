"""Processes of this machine: one a subject, so that its memory is given back and its death takes no other."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress

import psutil

from addb_viewer.dataset.engine.engine import ATTEMPTS, Done
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.left_out import LeftOut
from addb_viewer.dataset.receipts import Receipt, valid_receipt, write_receipt
from addb_viewer.dataset.subject_task import DISK_FAILED
from addb_viewer.dataset.task import Task

MEMORY_OF_A_WORKER = 1.6e9  # bytes; a fit of 10 000 frames needs 1.5 GB
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_LOOKED_EVERY_S = 0.5  # at a worker's memory


def usual_workers() -> int:
    """One a core, as far as the memory reaches."""
    return max(1, min(os.cpu_count() or 1, int(psutil.virtual_memory().total // MEMORY_OF_A_WORKER)))


class Processes:
    """So many workers at a time."""

    def __init__(self, workers: int, time_out_s: float | None = None) -> None:
        """Nothing is started yet.

        Args:
            workers: how many subjects are fitted at a time.
            time_out_s: after which a subject is given up; None: never.
        """
        self._workers, self._time_out_s = workers, time_out_s
        self._running: set[subprocess.Popen] = set()
        self._lock = threading.Lock()
        self._ended = False

    def run(self, tasks: Sequence[Task], done: Done) -> None:
        """Do all tasks; see `Engine`."""
        with ThreadPoolExecutor(self._workers) as pool:
            waiting = {pool.submit(self.result_of, task): task for task in tasks}
            try:
                for future in as_completed(waiting):
                    done(waiting[future], future.result())
            except BaseException:
                self._end()
                pool.shutdown(cancel_futures=True)
                raise

    def result_of(self, task: Task) -> Receipt:
        """A task's receipt, whatever becomes of its workers.

        Raises:
            ReleaseError: the disk fails again and again.
        """
        said, peak = "", 0.0
        for _ in range(ATTEMPTS):
            try:
                code, said, peak = self._one_worker(task)
            except subprocess.TimeoutExpired:
                why = f"not done after {self._time_out_s:g} s"
                gone = LeftOut("subject", task.who.subject_id, "timed_out", why)
                return Receipt(task.key, failed=gone)  # none on the disk: the next build tries again
            receipt = valid_receipt(task.out, task.key)
            if code == 0 and receipt is not None:
                return receipt
            if code > 0 and code != DISK_FAILED:
                break  # it would end the same way again
        if code == DISK_FAILED:
            raise ReleaseError(f"{task.who.subject_id}: {said}")
        reason, why = "fit_failed", f"unexpected {said or f'end with {code}'}"
        if code <= 0:
            name = signal.Signals(-code).name if code else "no receipt"
            reason, why = "worker_died", f"{name}, {ATTEMPTS} times; it had {peak:.0f} MB"
        lost = Receipt(task.key, failed=LeftOut("subject", task.who.subject_id, reason, why))
        write_receipt(lost, task.out)
        return lost

    def _one_worker(self, task: Task) -> tuple[int, str, float]:
        """Exit code, the last line that it said, and its greatest memory [MB]."""
        task.out.parent.mkdir(parents=True, exist_ok=True)
        file = task.out.with_suffix(".task.json")
        task.write(file)
        with self._lock:
            if self._ended:
                raise ReleaseError("stopped")
            process = subprocess.Popen(
                [sys.executable, "-m", "addb_viewer.dataset.subject_task", str(file)],
                stdin=subprocess.PIPE,  # held open until we end, however we do
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                env={**os.environ, **dict.fromkeys(_THREADS, "1")},
            )
            self._running.add(process)
        try:
            peak = _watched(process, self._time_out_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            file.unlink(missing_ok=True)
            raise
        finally:
            with self._lock:
                self._running.discard(process)
        lines = (process.stderr.read() if process.stderr else "").strip().splitlines()
        file.unlink(missing_ok=True)
        return process.returncode, lines[-1] if lines else "", peak

    def _end(self) -> None:
        with self._lock:
            self._ended = True
            for process in self._running:
                process.kill()


def _watched(process: subprocess.Popen, time_out_s: float | None) -> float:
    """Wait for the end; the greatest memory that was seen [MB].

    Raises:
        TimeoutExpired: it goes on.
    """
    peak, began = 0.0, time.monotonic()
    while True:
        if time_out_s is not None and time.monotonic() - began > time_out_s:
            raise subprocess.TimeoutExpired(process.args, time_out_s)
        with suppress(psutil.Error):
            peak = max(peak, psutil.Process(process.pid).memory_info().rss / 1e6)
        try:
            process.wait(_LOOKED_EVERY_S)
        except subprocess.TimeoutExpired:
            continue
        return peak
