"""The section of the page: our answers, and beside them two ordinary methods on cases that all answered."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hidden.format import CAUSES, checked
from benchmarks.hidden.rows import versions
from benchmarks.hidden.scorer import (
    CLEAN,
    INSIDE,
    OUTCOMES,
    OUTSIDE,
    Judged,
    bins_of,
    figures,
    judge,
    read_truths,
)
from benchmarks.markdown import rate, table

TITLES = {
    "ours": "`addb-viewer diagnose`",
    "least-squares": "best single cause, least squares, BIC",
    "torso-shift": "torso's mass and centre shifted",
    "motion-alone": "motion alone",
}
NAMING_NOTHING = ("torso-shift", "motion-alone")
SMALL = 300  # cases, below which the page says that they are few

SECTION = """## The draw

Made by `python -m benchmarks.hidden make | run | page`, {code}: {answered} of {drawn} cases that were drawn,
{all_groups}. How to take part, and what each figure means: [hidden/FORMAT.md](hidden/FORMAT.md).

### Our answers

{ours}

By what is hidden (outside the list: unknown causes, and those of the list at 10 and 30 times their size):

{by_effect}

By size, of what is on the list and has one (reference sizes hold for walks, so squats get larger ones):

{by_size}

How sure the likeliest name is, and how often it is right:

{by_confidence}

### Beside two ordinary methods

On the {count} cases that every row has answered: {groups}.{few}

{table}
"""


def section(out: Path, truth: Path, results: Path) -> str:
    """Judge our row on all that it answered, and every row on the cases that all rows answered."""
    raw = {row: _answers(results / row) for row in TITLES}
    all_truths = read_truths(truth)
    own = {case: all_truths[case] for case in raw["ours"]}
    ours = dict(zip(own, _judged(raw["ours"], own), strict=True))
    answered = set.intersection(*(set(answers) for answers in raw.values()))
    truths = {case: t for case, t in all_truths.items() if case in answered}
    columns = {row: _column(row, _judged(answers, truths)) for row, answers in raw.items()}
    names = list(next(iter(columns.values())))
    rows = [[name, *(columns[row][name] for row in TITLES)] for name in names]
    return SECTION.format(
        code="code " + ", ".join(versions(results)),
        answered=len(ours),
        drawn=len(list(out.glob("case_*"))),
        all_groups=_counted(own),
        ours=table(["", TITLES["ours"]], [row for row in figures([*ours.values()]) if row[1] != "-"]),
        by_effect=_by_effect(own, ours),
        by_size=_by_size(own, ours),
        by_confidence=_by_confidence([*ours.values()]),
        count=len(truths),
        groups=_counted(truths),
        few=" **These are few: the intervals are wide, and no order of the rows is shown by them.**"
        if len(truths) < SMALL
        else "",
        table=table(["", *TITLES.values()], rows),
    )


def _counted(truths: Mapping[str, Any]) -> str:
    counts = Counter(t["group"] for t in truths.values())
    words = {INSIDE: "inside the list", OUTSIDE: "outside it", CLEAN: "clean"}
    return ", ".join(f"{counts[group]} {word}" for group, word in words.items())


def _by_effect(truths: Mapping[str, Any], judged: Mapping[str, Judged]) -> str:
    rows: dict[tuple[int, str], list[Judged]] = {}
    for case, one in judged.items():
        name = " and ".join(_called(effect, one.group) for effect in truths[case]["effects"])
        rows.setdefault(((INSIDE, OUTSIDE, CLEAN).index(one.group), name or "nothing"), []).append(one)
    lines = [
        [("inside", "outside", "")[k], name, str(len(of)), *(_often(of, outcome) for outcome in OUTCOMES)]
        for (k, name), of in sorted(rows.items())
    ]
    return table(["", "hidden", "cases", *OUTCOMES], lines)


def _by_size(truths: Mapping[str, Any], judged: Mapping[str, Judged]) -> str:
    rows: dict[tuple[str, float], list[Judged]] = {}
    for case, one in judged.items():
        for effect in truths[case]["effects"]:
            if effect["id"] in CAUSES and effect["parameters"]:
                activity = "squat" if min(truths[case]["held_out"]).startswith("squat") else "walk"
                rows.setdefault((activity, effect["size"]), []).append(one)
    lines = [
        [
            activity,
            f"× {size:g}",
            rate(sum(one.right for one in of), len(of)),
            rate(sum(one.outcome != "none" for one in of), len(of)),
        ]
        for (activity, size), of in sorted(rows.items(), key=lambda row: (row[0][0] != "walk", row[0][1]))
    ]
    return table(["", "size", "right", "not called sound"], lines)


def _called(effect: Mapping[str, Any], group: str) -> str:
    name = str(effect["id"])
    return f"{name} × {effect['size']:g}" if group == OUTSIDE and name in CAUSES else name


def _often(judged: list[Judged], outcome: str) -> str:
    return str(sum(one.outcome == outcome for one in judged) or "")


def _by_confidence(judged: list[Judged]) -> str:
    confidence = np.array([one.confidence for one in judged])
    right = np.array([one.right for one in judged])
    bins = bins_of(confidence)
    rows = [
        [f"{100 * confidence[bins == k].mean():.0f} %", rate(right[bins == k].sum(), (bins == k).sum())]
        for k in np.unique(bins)
    ]
    return table(["stated, mean", "right"], rows)


def _answers(folder: Path) -> dict[str, Any]:
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))}


def _judged(answers: Mapping[str, Any], truths: Mapping[str, Any]) -> list[Judged]:
    read = checked({case: answers[case] for case in truths}, truths)
    return [judge(truths[case], answer) for case, answer in read.items()]


def _column(row: str, judged: list[Judged]) -> dict[str, str]:
    """Figures by name; a row that names nothing has only those of held-out forces."""
    told = {name.split(" (")[0]: figure for name, figure in figures(judged)}
    if row not in NAMING_NOTHING:
        return told
    return {name: figure if name.startswith("held_out") else "-" for name, figure in told.items()}
