"""Our row: what `addb-viewer diagnose --json` says, as probabilities of the public names."""

from collections.abc import Mapping
from typing import Any

from benchmarks.hidden.classes import CAUSES, NONE, SOMETHING_ELSE

REFUSED = "on_the_list"  # a cause of the list that had too little evidence to be named
PUBLIC_NAME = {
    "trial_clocks": "clock_offset",
    "plate_clock": "clock_offset",
    "plate_units": "plate_gain",
}


def answer_of(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """The public answer. What is named first keeps its confidence; the others share the rest."""
    effects = diagnosis["effects"]
    if not effects:
        return {"probabilities": _of_none(diagnosis)}
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
