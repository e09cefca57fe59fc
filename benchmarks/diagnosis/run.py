"""Run the finder over made cases: each by the command line, with a time limit; finished ones are kept."""

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from solver.capture.atomic import write_whole

TIME_LIMIT_S = 300.0  # of wall time for a case


def run_all(out: Path, *, limit_s: float = TIME_LIMIT_S, discard: bool = False, only: str = "") -> None:
    """Answer every case of a folder that has no answer yet.

    Args:
        out: as `make` wrote it.
        limit_s: wall time after which a case counts as failed.
        discard: delete a case's recordings when it is answered.
        only: part of the case's name.
    """
    (out / "results").mkdir(exist_ok=True)
    waiting = [f for f in sorted((out / "subjects").iterdir()) if only in f.name]
    for n, folder in enumerate(waiting, start=1):
        result = out / "results" / f"{folder.name}.json"
        if result.exists():
            continue
        answer = run_one(folder, limit_s)
        write_whole(result, json.dumps(answer, indent=1) + "\n")
        shutil.rmtree(folder if discard else folder / "results", ignore_errors=True)
        said = (answer["diagnosis"] or {}).get("verdict") or answer["error"].splitlines()[-1:]
        print(f"{n}/{len(waiting)} {folder.name} {answer['seconds_cpu']:.1f} s {said}", flush=True)


def run_one(folder: Path, limit_s: float) -> dict[str, Any]:
    """One case in a process of its own: the diagnosis or what went wrong, and the CPU seconds it took."""
    before = _cpu_of_children()
    error = ""
    with tempfile.TemporaryDirectory() as scratch:
        answer = Path(scratch) / "diagnosis.json"
        command = [sys.executable, "-m", "addb_viewer", "diagnose", str(folder), "--json", str(answer)]
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=limit_s,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
                check=False,
            )
            if done.returncode:
                error = (done.stderr or done.stdout)[-2000:] or f"exit status {done.returncode}"
        except subprocess.TimeoutExpired:
            error = f"not done after {limit_s:g} s"
        diagnosis = json.loads(answer.read_text()) if answer.exists() and not error else None
    if diagnosis is None and not error:
        error = "no answer written"
    return {"diagnosis": diagnosis, "error": error, "seconds_cpu": _cpu_of_children() - before}


def _cpu_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
