"""What an untouched real recording says of an effect: the injected difference is counted from there.

A real recording has clocks, plates and masses of its own, most of them too little wrong to be named. The
finder's own estimate of the same parameter, named or not, is what an injected one adds to.
"""

import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from benchmarks.diagnosis.information import balance_as_it_is
from solver.capture.atomic import write_whole
from solver.diagnosis.causes.catalogue import catalogue
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.diagnose import causes_of
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.refinement import refine
from solver.diagnosis.search.selection import Selection
from solver.diagnosis.search.terms import Term

ADDITIVE = (  # ids whose parameters add up when the same thing happens twice
    "clock_offset",
    "sample_rate",
    "plate_gain",
    "plate_bias",
    "plate_position",
    "plate_yaw",
    "gravity_tilt",
    "subject_mass",
    "capture_scale",
    "body_weight_support",
)
FILE = "matched_synthetics.json"


def estimate_matched_synthetics(out: Path) -> None:
    """Write, by case, the parameters that the untouched recording has of the injected effect."""
    estimated = read_matched_synthetics(out)
    for path in sorted((out / "truth").glob("real_*.json")):
        truth = json.loads(path.read_text())
        hidden = truth["effects"][0]
        if hidden["id"] in ADDITIVE and truth["case"] not in estimated:
            estimated[truth["case"]] = estimate(
                out / "subjects" / truth["baseline"], hidden["id"], hidden["target"]
            )
            write_whole(out / FILE, json.dumps(estimated, indent=1) + "\n")


def read_matched_synthetics(out: Path) -> dict[str, dict[str, float]]:
    """By case; empty where nothing was estimated."""
    path = out / FILE
    return dict(json.loads(path.read_text())) if path.exists() else {}


def estimate(folder: Path, id: str, target: str) -> dict[str, float]:
    """An effect's parameters in a recording, beside the causes that are named there."""
    balance, selection = _searched(folder)
    found = next((t for t in selection.solved.terms if t.candidate.key == (id, target)), None)
    if found is None:
        found = _fitted(balance, selection, id, target)
    if found is None:
        return {}
    others = [t for t in selection.solved.terms if t.candidate.key != (id, target)]
    solved = balance.solve_at([*others, found], selection.solved.noise_scale)
    estimates = solved.estimates(len(others), balance.scenes)
    return {name: float(e.value) for name, e in estimates.items()}


def _fitted(balance: Balance, selection: Selection, id: str, target: str) -> Term | None:
    terms = selection.solved.terms
    candidates: Sequence[Candidate] = catalogue(balance.scenes)
    for candidate in candidates:
        if candidate.key == (id, target):
            starts = [t for eta in candidate.starts(balance.scenes) if (t := balance.term(candidate, eta))]
            noise_scale = selection.solved.noise_scale
            best = max(
                starts, key=lambda t: balance.solve_at([*terms, t], noise_scale).log_evidence, default=None
            )
            return None if best is None else refine(balance, best, terms, noise_scale)
    return None


@lru_cache(maxsize=16)
def _searched(folder: Path) -> tuple[Balance, Selection]:
    return causes_of(balance_as_it_is(folder))
