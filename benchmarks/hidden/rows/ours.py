"""Our row: what `addb-viewer diagnose --json` says, as probabilities of the public names."""

from collections.abc import Mapping
from typing import Any

from benchmarks.hidden.classes import CAUSES, NONE, SOMETHING_ELSE

# The answer states no probability where it names no cause: fixed before any case was scored.
CLEAN = {NONE: 0.9, SOMETHING_ELSE: 0.1}
UNEXPLAINED = {SOMETHING_ELSE: 0.9, NONE: 0.1}
PUBLIC_NAME = {
    "trial_clocks": "clock_offset",
    "plate_clock": "clock_offset",
    "plate_units": "plate_gain",
}


def answer_of(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """The public answer. What is named first keeps its confidence; the others share the rest."""
    effects = diagnosis["effects"]
    if not effects:
        said = CLEAN if diagnosis["verdict"] == "clean" else UNEXPLAINED
        return {"probabilities": dict(said)}
    first = effects[0]
    weights: dict[str, float] = {}
    for entry in (*effects[1:], *diagnosis["alternatives"]):
        name = public(entry["id"])
        weights[name] = weights.get(name, 0.0) + (entry["confidence"] or 0.0)
    outside = first["outside_the_list"] or 0.0
    weights[SOMETHING_ELSE] = weights.get(SOMETHING_ELSE, 0.0) + outside
    rest = 1.0 - first["confidence"]
    total = sum(weights.values())
    shared = {n: rest * w / total for n, w in weights.items()} if total else {SOMETHING_ELSE: rest}
    name = public(first["id"])
    probabilities = shared | {name: shared.get(name, 0.0) + first["confidence"]}
    stated = {n: v["value"] for n, v in first["parameters"].items() if v["value"] is not None}
    return {"probabilities": probabilities, "parameters": stated}


def public(id: str) -> str:
    """The public name of a cause of ours; what the public list lacks is something else."""
    name = PUBLIC_NAME.get(id, id)
    return name if name in CAUSES else SOMETHING_ELSE
