"""Every row over every case: our answer, and the ordinary methods'; what is answered already stays.

Ours is what `addb-viewer diagnose --json` says, as probabilities of the public names.
"""

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosing import run_one
from benchmarks.hidden.format import CAUSES, NONE, SOMETHING_ELSE
from benchmarks.hidden.ordinary import MarkerBalance, best_single_cause, marker_balances, with_torso_shifted
from benchmarks.recordings import program_version
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


REFUSED = "on_the_list"  # a cause of the list that had too little evidence to be named
PUBLIC_NAME = {"trial_clocks": "clock_offset", "plate_clock": "clock_offset", "plate_units": "plate_gain"}


def answer_of(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """The public answer: every name has the chance that is stated for it.

    Those that are stated seldom sum to one, since a name's many rivals are not all listed: what is left is
    shared by the names that are not.
    """
    effects = diagnosis["effects"]
    if not effects:
        return {"probabilities": _of_none(diagnosis)}
    first = effects[0]
    named, rest = public(first["id"]), 1.0 - first["confidence"]
    others = {SOMETHING_ELSE: first["outside_the_list"] or 0.0}
    for entry in (*effects[1:], *diagnosis["alternatives"]):
        name = public(entry["id"])
        others[name] = others.get(name, 0.0) + (entry["confidence"] or 0.0)
    stated_for_others = sum(others.values())
    if stated_for_others > rest:
        others = {name: chance * rest / stated_for_others for name, chance in others.items()}
    unlisted = [name for name in CAUSES if name not in (named, *others)]
    left = max(0.0, rest - stated_for_others) / len(unlisted)
    probabilities = dict.fromkeys(unlisted, left) | others
    probabilities[named] = probabilities.get(named, 0.0) + first["confidence"]
    stated = {n: v["value"] for n, v in first["parameters"].items() if v["value"] is not None}
    return {"probabilities": probabilities, "parameters": stated}


def _of_none(diagnosis: Mapping[str, Any]) -> dict[str, float]:
    """Where no cause is named, the chances that are stated; the best refused one has that of the list."""
    chances = diagnosis["chances"]
    refused = [d for d in diagnosis["decisions"] if d["odds_nats"] is not None]
    best = max(refused, key=lambda d: d["odds_nats"], default=None)
    probabilities = {NONE: chances["nothing"], SOMETHING_ELSE: chances["something_else"]}
    name = SOMETHING_ELSE if best is None else public(best["id"])
    return probabilities | {name: probabilities.get(name, 0.0) + chances[REFUSED]}


def public(id: str) -> str:
    """The public name of a cause of ours; what the public list lacks is something else."""
    name = PUBLIC_NAME.get(id, id)
    return name if name in CAUSES else SOMETHING_ELSE


KEPT = "versions.json"


def versions(results: Path) -> list[str]:
    """Commits that answered cases, in the order of their runs."""
    path = results / KEPT
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def note_version(results: Path) -> None:
    """Add the present commit."""
    known = versions(results)
    own = program_version()
    if own not in known:
        results.mkdir(parents=True, exist_ok=True)
        (results / KEPT).write_text(json.dumps([*known, own]) + "\n", encoding="utf-8")
