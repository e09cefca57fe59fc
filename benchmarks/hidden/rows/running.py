"""Every method over every case; what is answered already stays."""

import json
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis.run import run_one
from benchmarks.hidden.classes import NONE, SOMETHING_ELSE
from benchmarks.hidden.rows.balance import MarkerBalance, marker_balances
from benchmarks.hidden.rows.least_squares import best_single_cause
from benchmarks.hidden.rows.ours import answer_of
from benchmarks.hidden.rows.torso_shift import with_torso_shifted
from benchmarks.hidden.rows.versions import note_version
from solver.capture.atomic import write_whole
from solver.common.errors import SolverError

OURS, LEAST_SQUARES, TORSO, MOTION = "ours", "least-squares", "torso-shift", "motion-alone"

HELD_OUT_FROM = 0.8  # of the frames, as the format page says
NAMES_NOTHING = {NONE: 1 / 3, SOMETHING_ELSE: 2 / 3}
Predicted = Sequence[np.ndarray]


def run_all(out: Path, results: Path, limit_s: float) -> None:
    """Write RESULTS/ROW/CASE.json for each case of OUT that lacks one."""
    note_version(results)
    for folder in sorted(path for path in out.iterdir() if path.is_dir()):
        answer_from_balance(folder, results)
        kept = _kept(results, OURS, folder.name)
        if not kept.exists():
            _write(kept, our_answer(folder, limit_s))
        print(folder.name, flush=True)


def our_answer(folder: Path, limit_s: float) -> dict[str, Any]:
    """Of the diagnosis, which writes beside a copy of the case; without one, that nothing is known."""
    with tempfile.TemporaryDirectory() as scratch:
        diagnosis = run_one(Path(shutil.copytree(folder, Path(scratch) / folder.name)), limit_s)["diagnosis"]
    return {"probabilities": NAMES_NOTHING} if diagnosis is None else answer_of(diagnosis)


def answer_from_balance(folder: Path, results: Path) -> None:
    """The three rows that rest on a fit of the markers."""
    rows: dict[str, Callable[[Sequence[MarkerBalance]], dict[str, Any]]] = {
        LEAST_SQUARES: _single_cause,
        TORSO: lambda balances: _naming_nothing(balances, with_torso_shifted(balances)),
        MOTION: lambda balances: _naming_nothing(balances, [b.required for b in balances]),
    }
    missing = [row for row in rows if not _kept(results, row, folder.name).exists()]
    if not missing:
        return
    try:
        balances = marker_balances(folder)
    except SolverError:
        balances = []
    for row in missing:
        answer = rows[row](balances) if balances else {"probabilities": NAMES_NOTHING}
        _write(_kept(results, row, folder.name), answer)


def _single_cause(balances: Sequence[MarkerBalance]) -> dict[str, Any]:
    probabilities, best = best_single_cause(balances)
    predicted = [b.required - left for b, left in zip(balances, best.left_out, strict=True)]
    return {
        "probabilities": probabilities,
        "parameters": best.parameters,
        "held_out": _held_out(balances, predicted),
    }


def _naming_nothing(balances: Sequence[MarkerBalance], predicted: Predicted) -> dict[str, Any]:
    return {"probabilities": NAMES_NOTHING, "held_out": _held_out(balances, predicted)}


def _held_out(balances: Sequence[MarkerBalance], predicted: Predicted) -> dict[str, Any]:
    told = {}
    for b, wrench in zip(balances, predicted, strict=True):
        rows = b.about_origin(wrench)[int(np.ceil(HELD_OUT_FROM * len(b.times))) :].round(3)
        told[b.trial] = {"force_N": rows[:, :3].tolist(), "moment_Nm": rows[:, 3:].tolist()}
    return told


def _kept(results: Path, row: str, case: str) -> Path:
    return results / row / f"{case}.json"


def _write(path: Path, answer: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, json.dumps(answer) + "\n")
