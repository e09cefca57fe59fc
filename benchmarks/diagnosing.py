"""Run the finder over made cases, each by the command line and within a CPU time; finished ones are kept."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from solver.capture.atomic import write_whole

CPU_LIMIT_S = 300.0
WALL_PER_CPU = 10.0  # a busy machine is no failure of the finder
LOOK_AGAIN_S = 0.05


def run_all(
    out: Path, *, limit_s: float = CPU_LIMIT_S, discard: bool = False, only: str = "", workers: int = 1
) -> None:
    """Answer every case of a folder that has no answer yet.

    Args:
        out: as `make` wrote it.
        limit_s: CPU time after which a case counts as failed.
        discard: delete a case's recordings when it is answered.
        only: part of the case's name.
        workers: cases at a time.
    """
    (out / "results").mkdir(exist_ok=True)
    waiting = [f for f in sorted((out / "subjects").iterdir()) if only in f.name]
    waiting = [f for f in waiting if not (out / "results" / f"{f.name}.json").exists()]

    def answered(n: int, folder: Path) -> None:
        answer = run_one(folder, limit_s)
        write_whole(out / "results" / f"{folder.name}.json", json.dumps(answer, indent=1) + "\n")
        shutil.rmtree(folder if discard else folder / "results", ignore_errors=True)
        said = (answer["diagnosis"] or {}).get("verdict") or answer["error"].splitlines()[-1:]
        print(f"{n}/{len(waiting)} {folder.name} {answer['seconds_cpu']:.1f} s {said}", flush=True)

    with ThreadPoolExecutor(workers) as pool:
        for done in [pool.submit(answered, n, folder) for n, folder in enumerate(waiting, start=1)]:
            done.result()


def run_one(folder: Path, limit_s: float) -> dict[str, Any]:
    """One case in a process of its own: the diagnosis or what went wrong, and the CPU seconds it took."""
    with tempfile.TemporaryDirectory() as scratch:
        answer = Path(scratch) / "diagnosis.json"
        command = [sys.executable, "-m", "addb_viewer", "diagnose", str(folder), "--json", str(answer)]
        error, seconds = _run(command, Path(scratch) / "said", limit_s)
        diagnosis = json.loads(answer.read_text()) if answer.exists() and not error else None
    if diagnosis is None and not error:
        error = "no answer written"
    return {"diagnosis": diagnosis, "error": error, "seconds_cpu": seconds}


def _run(command: Sequence[str], log: Path, limit_s: float) -> tuple[str, float]:
    """What went wrong, if anything, and the CPU seconds of the process."""
    limited = ["sh", "-c", f'ulimit -t {int(limit_s)}; exec "$0" "$@"', *command]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    started = time.monotonic()
    with log.open("wb") as said:
        process = subprocess.Popen(limited, stdout=said, stderr=subprocess.STDOUT, env=environment)
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() - started > WALL_PER_CPU * limit_s:
                process.kill()
            time.sleep(LOOK_AGAIN_S)
    code = process.returncode = os.waitstatus_to_exitcode(status)
    seconds = usage.ru_utime + usage.ru_stime
    if code < 0:
        return f"stopped by signal {-code} after {seconds:.0f} s of CPU", seconds
    text = log.read_text(errors="replace")
    return (text[-2000:] or f"exit status {code}") if code else "", seconds
