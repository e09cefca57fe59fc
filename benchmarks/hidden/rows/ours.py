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
