"""How sure the named causes are, and how often that is right."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.diagnosis.judge import same
from benchmarks.diagnosis.rates import rate, table
from benchmarks.hidden.scorer import VERY_SURE, calibration_error

BORDERS = (0.0, 0.5, 0.9, VERY_SURE, 1.0)


@dataclass(frozen=True)
class Naming:
    """One cause that an answer names."""

    case: str
    confidence: float
    right: bool


def namings(truth: dict[str, Any], diagnosis: dict[str, Any] | None) -> list[Naming]:
    """Every cause named in a case: right is a hidden effect of the catalogue, on its target, at its time."""
    hidden = truth["effects"] if truth["kind"] in ("single", "pair") else []
    found = (diagnosis or {}).get("effects", [])
    return [Naming(truth["case"], float(f["confidence"]), any(same(h, f) for h in hidden)) for f in found]


def sureness(cases: Sequence[tuple[dict[str, Any], dict[str, Any] | None]]) -> str:
    """The table: shares that are right by stated confidence, the calibration error, and who was surely wrong.

    Args:
        cases: truth and diagnosis of each that has a truth: single effects, pairs, clean and unknown ones.
    """
    named = [naming for truth, diagnosis in cases for naming in namings(truth, diagnosis)]
    if not named:
        return ""
    confidence = np.array([n.confidence for n in named])
    right = np.array([n.right for n in named])
    rows: list[Sequence[object]] = []
    for low, high in pairwise(BORDERS):
        within = (confidence >= low) & ((confidence < high) | (high == BORDERS[-1]))
        if within.any():
            stated = f"{100 * confidence[within].mean():.0f} %"
            between = f"{100 * low:.0f} to {100 * high:.0f} %"
            rows.append([between, stated, rate(int(right[within].sum()), int(within.sum()))])
    surely_wrong = {n.case for n in named if n.confidence >= VERY_SURE and not n.right}
    error = calibration_error(confidence, right)
    share = rate(len(surely_wrong), len(cases))
    told = f"Expected calibration error over {len(named)} named causes (ten bins): {error:.3f}. "
    told += f"Cases with a name that is very sure ({100 * VERY_SURE:.0f} % and more) and wrong: {share}"
    told += f": {', '.join(sorted(surely_wrong))}" if surely_wrong else ""
    return table(["stated", "in the mean", "right"], rows) + f"\n\n{told}."
