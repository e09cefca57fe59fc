"""One answer against the truth of its case."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.hidden.scorer import NEAR, scale_of

DEVIATIONS = 2.0
LARGEST_CLASS = 3
LEAST_OVERLAP = 0.3  # of frames (intersection over union) for an event in time to be the same event
TIMED = ("off_plate_step", "external_contact", "marker_swap")  # effects that are events


@dataclass(frozen=True)
class ParameterScore:
    """One parameter of an effect that was named right."""

    name: str
    true: float
    found: float
    std: float | None
    near: bool


@dataclass(frozen=True)
class Verdict:
    """How an answer does.

    `outcome` of a single effect: right, right_but_more (others were named as well), class (a class of at most
    three holds it), id_only (another target), wrong, unexplained, missed (called clean), failed (no answer).
    Clean cases: right, false_alarm, unexplained. Unknown ones: right, wrong_body, contact (a free contact at
    the right body, which says the same in other words), wrong, missed. Pairs: right, one, class, wrong, ….
    """

    case: str
    kind: str
    outcome: str
    named: tuple[str, ...] = ()
    id_right: bool = False
    parameters: tuple[ParameterScore, ...] = field(default_factory=tuple)


def judged(truth: dict[str, Any], diagnosis: dict[str, Any] | None) -> Verdict:
    """Compare the JSON of a diagnosis with the JSON of a truth; None: there was no answer."""
    case, kind = truth["case"], truth["kind"]
    if diagnosis is None:
        return Verdict(case, kind, "failed")
    found = diagnosis.get("effects", [])
    named = tuple(effect["id"] for effect in found)
    verdict = diagnosis.get("verdict")
    if kind == "clean":
        outcome = {"clean": "right", "unexplained": "unexplained"}.get(str(verdict), "false_alarm")
        return Verdict(case, kind, "false_alarm" if found else outcome, named)
    if kind == "unknown":
        return Verdict(case, kind, _unknown(truth["effects"][0], diagnosis), named)
    hidden = truth["effects"]
    matched = [next((f for f in found if same(h, f)), None) for h in hidden]
    id_right = all(h["id"] in named for h in hidden)
    scores = tuple(
        s for h, f in zip(hidden, matched, strict=True) if f is not None for s in parameter_scores(h, f)
    )
    outcome = (_pair if kind == "pair" else _single)(hidden, matched, diagnosis)
    return Verdict(case, kind, outcome, named, id_right, scores)


def same(hidden: dict[str, Any], found: dict[str, Any]) -> bool:
    """The same id on the same target, and for an event at about the same time."""
    if hidden["id"] != found["id"] or not same_target(hidden, str(found.get("target"))):
        return False
    if hidden["id"] in TIMED and hidden["frames"] and found.get("frames"):
        return overlap(hidden["frames"], found["frames"]) >= LEAST_OVERLAP
    return True


def same_target(hidden: dict[str, Any], target: str) -> bool:
    """Whatever the order of joined names, and by any of the names that mean the same."""
    wanted = [hidden["target"], *hidden["same_as"]]
    return any(set(w.split("+")) == set(target.split("+")) for w in wanted)


def overlap(hidden: Iterable[Iterable[int]], found: Iterable[Iterable[Any]]) -> float:
    """Intersection over union of frames; a found range may begin with its trial's name."""
    one = {k for a, b in hidden for k in range(a, b)}
    other = {k for r in found for k in range(*[int(x) for x in list(r)[-2:]])}
    return len(one & other) / max(len(one | other), 1)


def parameter_scores(hidden: dict[str, Any], found: dict[str, Any]) -> list[ParameterScore]:
    """Every hidden parameter that the answer states."""
    scores = []
    for name, true in hidden["parameters"].items():
        stated = found.get("parameters", {}).get(name)
        if stated is None:
            continue
        value, std = float(stated["value"]), stated.get("std")
        std = float(std) if std else None
        error = abs(value - true)
        near = error <= NEAR * scale_of(name, hidden["parameters"])
        near = near or (std is not None and error <= DEVIATIONS * std)
        scores.append(ParameterScore(name, true, value, std, near))
    return scores


def _single(hidden: list, matched: list, diagnosis: dict[str, Any]) -> str:
    found, others = diagnosis.get("effects", []), diagnosis.get("alternatives", [])
    if matched[0] is not None:
        return "right" if len(found) == 1 else "right_but_more"
    if not found and diagnosis.get("verdict") == "clean":
        return "missed"
    if len(found) + len(others) <= LARGEST_CLASS and any(same(hidden[0], o) for o in others):
        return "class"
    if not found:
        return "unexplained"
    return "id_only" if any(f["id"] == hidden[0]["id"] for f in found) else "wrong"


def _pair(hidden: list, matched: list, diagnosis: dict[str, Any]) -> str:
    found, others = diagnosis.get("effects", []), diagnosis.get("alternatives", [])
    hits = sum(m is not None for m in matched)
    if hits == len(hidden):
        return "right" if len(found) == len(hidden) else "right_but_more"
    held = sum(m is not None or any(same(h, o) for o in others) for h, m in zip(hidden, matched, strict=True))
    if held == len(hidden) and len(others) < LARGEST_CLASS:
        return "class"
    if hits:
        return "one"
    if not found:
        return "missed" if diagnosis.get("verdict") == "clean" else "unexplained"
    return "wrong"


def _unknown(hidden: dict[str, Any], diagnosis: dict[str, Any]) -> str:
    found = diagnosis.get("effects", [])
    if diagnosis.get("verdict") == "clean":
        return "missed"
    bodies = hidden["bodies"]
    if found:
        contact = all(f["id"] == "external_contact" and f["target"] in bodies for f in found)
        return "contact" if contact and bodies else "wrong"
    if not bodies:  # a pure torque has no place
        return "right"
    return "right" if located_at(diagnosis) in bodies else "wrong_body"


def located_at(diagnosis: dict[str, Any]) -> str | None:
    """The body at which the unexplained remainder acts, if the answer names one."""
    location = (diagnosis.get("remaining") or {}).get("location")
    if isinstance(location, dict):
        location = location.get("body")
    return location if isinstance(location, str) else None
