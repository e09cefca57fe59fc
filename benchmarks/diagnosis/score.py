"""The tables of a benchmark run."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis.judge import ABOUT_ONE, Verdict, judged, same, scale_of
from benchmarks.diagnosis.matched_synthetics import read_matched_synthetics
from benchmarks.diagnosis.rates import rate, smallest_found, table
from benchmarks.diagnosis.sureness import sureness

OUTCOMES = ("right", "class", "right_but_more", "id_only", "wrong", "unexplained", "missed", "failed")
MADE_UP = ("single", "pair", "unknown", "clean")  # kinds of which all that is wrong is known
REAL_WITHIN = 0.20  # of the injected difference
UNDONE = 0.3  # of it left


@dataclass(frozen=True)
class Scored:
    """A case with its truth, its answer and what that is worth."""

    truth: dict[str, Any]
    answer: dict[str, Any]
    verdict: Verdict
    untouched: dict[str, float] = field(default_factory=dict)  # of a real recording without the effect

    @property
    def id(self) -> str:
        """What was hidden, joined by a plus; `clean` if nothing was."""
        return "+".join(e["id"] for e in self.truth["effects"]) or "clean"

    @property
    def size(self) -> float:
        """Of the first effect, in reference sizes."""
        return float(self.truth["effects"][0]["size"])

    def about(self, part: str, key: str) -> Any:
        """Something about the world or the handout."""
        return self.truth["world"].get(part, {}).get(key)


def load(out: Path) -> list[Scored]:
    """Every answered case."""
    scored, matched_synthetics = [], read_matched_synthetics(out)
    for path in sorted((out / "results").glob("*.json")):
        truth = json.loads((out / "truth" / path.name).read_text())
        answer = json.loads(path.read_text())
        verdict = judged(truth, answer["diagnosis"])
        scored.append(Scored(truth, answer, verdict, matched_synthetics.get(truth["case"], {})))
    return scored


def report(cases: Sequence[Scored]) -> str:
    """All tables."""
    single = _of(cases, "single")
    parts = [
        ("Naming, one hidden effect of the catalogue", naming(single)),
        ("By effect", by_effect(single)),
        ("Confusion: hidden in rows, first named in columns", confusion(single)),
        ("Clean recordings", controls(_of(cases, "clean"))),
        ("Effects outside the catalogue", unknowns(_of(cases, "unknown"))),
        ("Pairs", pairs(_of(cases, "pair"))),
        (
            "How sure, and how often right",
            sureness([(c.truth, c.answer["diagnosis"]) for c in cases if c.truth["kind"] in MADE_UP]),
        ),
        ("Parameters of effects named right", parameters([*single, *_of(cases, "pair")])),
        ("Smallest size found with 90 %, in reference sizes", detection(single)),
        ("Real recordings with an injected effect", real(_of(cases, "real"))),
        ("CPU seconds per case", seconds(cases)),
    ]
    return "\n\n".join(f"## {title}\n\n{text}" for title, text in parts if text)


def naming(single: Sequence[Scored]) -> str:
    """How many were named, in all and by what the laboratory handed over."""
    groups: list[tuple[str, Callable[[Scored], bool]]] = [
        ("all", lambda s: True),
        ("at and above reference size", lambda s: s.size >= 1),
        *[(f"model: {m}", _is("handout", "model", m)) for m in ("true", "perturbed", "generic")],
        *[(f"activity: {a}", _is("world", "activity", a)) for a in ("walk", "squat", "stand")],
        *[(f"layout: {p}", _is("world", "layout", p)) for p in ("treadmill", "overground")],
    ]
    rows = []
    for title, belongs in groups:
        chosen = [s for s in single if belongs(s)]
        if chosen:
            n = len(chosen)
            rows.append(
                [
                    title,
                    rate(sum(s.verdict.id_right for s in chosen), n),
                    rate(sum(s.verdict.outcome == "right" for s in chosen), n),
                    rate(sum(s.verdict.credit for s in chosen), n),
                ]
            )
    return table(["", "id", "id and target, nothing else", "a class of three counts half"], rows)


def by_effect(single: Sequence[Scored]) -> str:
    """Outcomes of every id."""
    rows = []
    for id in sorted({s.id for s in single}):
        counts = Counter(s.verdict.outcome for s in single if s.id == id)
        rows.append([id, sum(counts.values()), *[counts[o] or "" for o in OUTCOMES]])
    return table(["id", "cases", *OUTCOMES], rows) if rows else ""


def confusion(single: Sequence[Scored]) -> str:
    """What wrong answers say instead."""
    pairs = Counter((s.id, _first_named(s)) for s in single)
    columns = sorted({named for _, named in pairs})
    rows = [[id, *[pairs[id, c] or "" for c in columns]] for id in sorted({i for i, _ in pairs})]
    return table(["", *columns], rows) if rows else ""


def controls(clean: Sequence[Scored]) -> str:
    """False alarms."""
    n = len(clean)
    if not n:
        return ""
    named = [s for s in clean if s.verdict.outcome == "false_alarm"]
    odd = sum(s.verdict.outcome == "unexplained" for s in clean)
    failed = sum(s.verdict.outcome == "failed" for s in clean)
    rows: list[list[object]] = [
        ["any alarm", rate(len(named) + odd, n)],
        ["an effect named", rate(len(named), n)],
        ["called unexplained", rate(odd, n)],
        ["no answer", failed],
    ]
    for model in ("true", "perturbed", "generic"):
        own = [s for s in clean if s.about("handout", "model") == model]
        alarms = sum(s.verdict.outcome in ("false_alarm", "unexplained") for s in own)
        rows.append([f"any alarm, model: {model}", rate(alarms, len(own))])
    said = Counter(name for s in named for name in s.verdict.named)
    return table(["", "rate"], rows) + "\n\nNamed: " + (_counted(said) or "nothing")


def unknowns(cases: Sequence[Scored]) -> str:
    """Effects that have no name."""
    rows = []
    for id in ["all", *sorted({s.id for s in cases})]:
        own = [s for s in cases if id in ("all", s.id)]
        counts = Counter(s.verdict.outcome for s in own)
        unexplained = counts["right"] + counts["wrong_body"]
        rows.append(
            [
                id,
                rate(unexplained, len(own)),
                rate(counts["right"], len(own)),
                rate(counts["right"] + counts["contact"], len(own)),
                counts["wrong"],
                counts["missed"],
                counts["failed"],
            ]
        )
    head = ["", "unexplained", "and the right body", "or a free contact there", "named", "missed", "failed"]
    return table(head, rows) if cases else ""


def pairs(cases: Sequence[Scored]) -> str:
    """Two effects at once."""
    if not cases:
        return ""
    counts = Counter(s.verdict.outcome for s in cases)
    both = counts["right"] + counts["right_but_more"]
    rows: list[list[object]] = [
        ["both named", rate(both, len(cases))],
        ["both named and nothing else", rate(counts["right"], len(cases))],
    ]
    rows += [[o, counts[o]] for o in ("class", "one", "wrong", "unexplained", "missed", "failed")]
    return table(["", ""], rows)


def parameters(cases: Sequence[Scored]) -> str:
    """Errors against stated standard deviations."""
    by_name: dict[str, list] = {}
    whole = [s for s in cases if s.verdict.parameters]
    for s in whole:
        for p in s.verdict.parameters:
            by_name.setdefault(p.name, []).append(p)
    rows = []
    for name, scores in [("all", [p for ps in by_name.values() for p in ps]), *sorted(by_name.items())]:
        z = np.array([p.z for p in scores if p.z is not None])
        error = float(np.median([abs(p.found - p.true) for p in scores])) if scores else 0.0
        rows.append(
            [
                name,
                rate(sum(p.near for p in scores), len(scores)),
                f"{error:.3g}" if name != "all" else "",
                f"{np.sqrt(np.median(z**2)) / 0.6745:.2f}" if len(z) else "-",
                rate(float((np.abs(z) <= 2).sum()), len(z)),
            ]
        )
    every = rate(sum(all(p.near for p in s.verdict.parameters) for s in whole), len(whole))
    head = ["parameter", "within 10 % or 2 sd", "median error", "error over sd (robust)", "within 2 sd"]
    return (table(head, rows) + f"\n\nCases with every parameter so: {every}") if whole else ""


def detection(single: Sequence[Scored]) -> str:
    """Rates by size, and the smallest size that is nearly always found."""
    sizes = sorted({round(s.size, 3) for s in single if s.id != "marker_swap"})
    if len(sizes) < 2:
        return ""
    rows = []
    for id in sorted({s.id for s in single}):
        own = [s for s in single if s.id == id]
        cells = [
            rate(sum(s.verdict.credit for s in own if abs(s.size - size) < 1e-3), k) if k else ""
            for size in sizes
            for k in [sum(abs(s.size - size) < 1e-3 for s in own)]
        ]
        smallest = smallest_found([s.size for s in own], [s.verdict.credit for s in own])
        rows.append([id, *cells, "-" if smallest is None else f"{smallest:g}"])
    return table(["id", *[f"× {s:g}" for s in sizes], "90 % from"], rows)


def real(cases: Sequence[Scored]) -> str:
    """With an injected effect against the same recording without it."""
    injected = [s for s in cases if s.truth["effects"]]
    if not injected:
        return ""
    matched_synthetics = {s.truth["case"]: s for s in cases if not s.truth["effects"]}
    rows, named, near, counted, cancelled = [], 0, 0, 0, 0
    for s in injected:
        hidden = s.truth["effects"][0]
        found = _matching(hidden, s)
        answer = " ".join(s.verdict.named) or (s.answer["diagnosis"] or {}).get("verdict", "failed")
        begun = [s.truth["baseline"], hidden["id"], hidden["target"], f"{hidden['size']:g}", answer]
        if _cancels(hidden["parameters"], s.untouched):
            cancelled += 1
            rows.append([*begun, "left out", ""])
            continue
        named += found is not None
        good = None
        if found is not None and hidden["parameters"]:
            good = all(
                abs(found[k] - s.untouched.get(k, _nothing(k)) - (v - _nothing(k)))
                <= REAL_WITHIN * scale_of(k, hidden["parameters"]) + 1e-12
                for k, v in hidden["parameters"].items()
                if k in found and k != "time_s"
            )
            counted, near = counted + 1, near + good
        rows.append(
            [
                *begun,
                "yes" if found is not None else "",
                "" if good is None else ("yes" if good else "no"),
            ]
        )
    alone = [
        [name, (t.answer["diagnosis"] or {}).get("verdict", "failed"), " ".join(t.verdict.named)]
        for name, t in sorted(matched_synthetics.items())
    ]
    head = ["recording", "injected", "target", "size", "answer", "named", "difference within 20 %"]
    return "\n\n".join(
        [
            f"Named: {rate(named, len(injected) - cancelled)}; parameters within 20 %: {rate(near, counted)}"
            f"; left out, since they undo what the recording has of its own: {cancelled}",
            table(head, rows),
            "As they are:",
            table(["recording", "verdict", "named"], alone),
        ]
    )


def seconds(cases: Iterable[Scored]) -> str:
    """What an answer costs."""
    rows: list[list[object]] = []
    groups: dict[str, list[float]] = {}
    for s in cases:
        activity = s.about("world", "activity") or "real"
        groups.setdefault(str(activity), []).append(float(s.answer["seconds_cpu"]))
    for name, spent in sorted(groups.items()):
        rows.append(
            [
                name,
                len(spent),
                *[f"{v:.1f}" for v in (np.median(spent), np.percentile(spent, 90), max(spent))],
            ]
        )
    return table(["", "cases", "median", "90 %", "most"], rows) if rows else ""


def _of(cases: Sequence[Scored], kind: str) -> list[Scored]:
    return [s for s in cases if s.truth["kind"] == kind]


def _is(part: str, key: str, value: str) -> Callable[[Scored], bool]:
    return lambda s: s.about(part, key) == value


def _first_named(s: Scored) -> str:
    if s.answer["diagnosis"] is None:
        return "(no answer)"
    return s.verdict.named[0] if s.verdict.named else f"({s.answer['diagnosis'].get('verdict')})"


def _counted(counts: Counter) -> str:
    return ", ".join(f"{name} {n}" for name, n in counts.most_common())


def _matching(hidden: dict[str, Any], s: Scored) -> dict[str, float] | None:
    """Parameter values of the effect in an answer, if it names it."""
    for found in (s.answer["diagnosis"] or {}).get("effects", []):
        if same(hidden, found):
            return {k: float(p["value"]) for k, p in found.get("parameters", {}).items()}
    return None


def _cancels(injected: dict[str, float], untouched: dict[str, float]) -> bool:
    """Whether little is left of it beside what the recording had of its own, the other way."""
    own = {k: untouched[k] - _nothing(k) for k in injected if k in untouched}
    put_in = {k: injected[k] - _nothing(k) for k in own}
    left = sum((put_in[k] + own[k]) ** 2 for k in own)
    return bool(own) and left < UNDONE**2 * sum(v**2 for v in put_in.values())


def _nothing(name: str) -> float:
    """A parameter's value where nothing happened."""
    return 1.0 if name in ABOUT_ONE else 0.0
