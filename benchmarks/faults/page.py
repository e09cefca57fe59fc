"""The section of a run."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.faults.editor.draw import CLEAN, KINDS
from benchmarks.faults.editor.sources import SOURCES
from benchmarks.faults.judge import FAULTED, UNTOUCHED, Verdict, judged, with_seconds
from benchmarks.markdown import rate, table

SECTION = """## The draw

Made by `make bench-faults`, seed {seed}, {code}: {answered} of {planned} cases answered.
{note}
### All

{summary}

### By kind of fault

{kinds}

### What was left alone, by recording

{clean}

### Case by case

{cases}
"""


def load(out: Path) -> list[Verdict]:
    """All cases that were answered; names that a fault's recording gets left alone as well are marked."""
    verdicts = []
    for path in sorted((out / "results").glob("*.json")):
        answer = json.loads(path.read_text(encoding="utf-8"))
        if answer["diagnosis"] is not None:
            answer["diagnosis"] = with_seconds(answer["diagnosis"])
        truth = truth_of(out, path.stem)
        verdicts.append(judged(truth, answer))
    sources = {v.case: truth_of(out, v.case)["source"] for v in verdicts}
    alone = {(sources[v.case], name) for v in verdicts if v.kind == CLEAN for name in v.beside}
    return [
        replace(v, also_alone=bool(v.beside) and all((sources[v.case], name) in alone for name in v.beside))
        for v in verdicts
    ]


def truth_of(out: Path, case: str) -> dict[str, Any]:
    """What was done to a case."""
    truth: dict[str, Any] = json.loads((out / "truth" / f"{case}.json").read_text(encoding="utf-8"))
    return truth


def section(out: Path) -> str:
    """Markdown.

    Args:
        out: of the draw; what its `note.txt` says stands above the figures.
    """
    note = out / "note.txt"
    verdicts = load(out)
    about = json.loads((out / "cases.json").read_text(encoding="utf-8"))
    return SECTION.format(
        seed=about["seed"],
        code=about["code"],
        answered=len(verdicts),
        planned=len(list((out / "truth").glob("*.json"))),
        summary=summary(verdicts),
        kinds=by_kind(verdicts),
        clean=_clean(out, verdicts),
        cases=_cases(out, verdicts),
        note=f"\n{note.read_text(encoding='utf-8').strip()}\n" if note.exists() else "",
    )


def summary(verdicts: Sequence[Verdict]) -> str:
    """The rates that count."""
    faulted = [v for v in verdicts if v.kind != CLEAN]
    clean = [v for v in verdicts if v.kind == CLEAN]
    seconds = [v.seconds_cpu for v in verdicts]
    said = Counter(v.outcome for v in faulted)
    alarms = Counter(v.outcome for v in clean)
    rows = [
        ["faults: right", rate(said["right"], len(faulted))],
        ["faults: right, and another name with it", rate(said["right_but_more"], len(faulted))],
        [
            "of them one that the recording gets left alone as well",
            rate(sum(v.outcome == "right_but_more" and v.also_alone for v in faulted), len(faulted)),
        ],
        [
            "faults: right, and tentative with it",
            rate(sum(v.outcome == "right" and v.tentative_count > 0 for v in faulted), len(faulted)),
        ],
        ["faults: its class", rate(said["class"], len(faulted))],
        ["faults: nothing but tentative", rate(said["tentative"], len(faulted))],
        ["faults: unexplained", rate(said["unexplained"], len(faulted))],
        ["faults: missed", rate(said["missed"], len(faulted))],
        ["faults: wrong", rate(said["wrong"], len(faulted))],
        ["faults: a wrong name, very sure", rate(sum(v.very_sure_and_wrong for v in faulted), len(faulted))],
        ["left alone: nothing said", rate(alarms["silent"], len(clean))],
        ["left alone: unexplained", rate(alarms["unexplained"], len(clean))],
        ["left alone: tentative", rate(alarms["tentative"], len(clean))],
        ["left alone: an alarm", rate(alarms["alarm"], len(clean))],
        ["left alone: an alarm, very sure", rate(sum(v.very_sure_and_wrong for v in clean), len(clean))],
        ["no answer", rate(said["failed"] + alarms["failed"], len(verdicts))],
    ]
    if seconds:
        rows.append(["CPU seconds, median and most", f"{np.median(seconds):.1f}, {np.max(seconds):.1f}"])
    return table(["", "rate"], rows)


def by_kind(verdicts: Sequence[Verdict]) -> str:
    """Outcomes as counts."""
    rows = []
    for kind in KINDS:
        own = [v for v in verdicts if v.kind == kind.name]
        said = Counter(v.outcome for v in own)
        sure = sum(v.very_sure_and_wrong for v in own)
        if own:
            cells = [said[outcome] or "" for outcome in FAULTED]
            rows.append([kind.name.replace("_", " "), rate(said["right"], len(own)), *cells, sure or ""])
    return table(["kind", "right", *(o.replace("_", " ") for o in FAULTED), "wrong and very sure"], rows)


def _clean(out: Path, verdicts: Sequence[Verdict]) -> str:
    rows = []
    for source in SOURCES:
        own = [v for v in verdicts if v.kind == CLEAN and truth_of(out, v.case)["source"] == source.name]
        said = Counter(v.outcome for v in own)
        cells = [said[outcome] or "" for outcome in UNTOUCHED]
        if own:
            rows.append([source.name, *cells, sum(v.very_sure_and_wrong for v in own) or ""])
    return table(["recording", *UNTOUCHED, "very sure"], rows)


def _cases(out: Path, verdicts: Sequence[Verdict]) -> str:
    rows = []
    for v in sorted(verdicts, key=lambda v: (v.kind, v.case)):
        truth = truth_of(out, v.case)
        said = "; ".join(v.named) or "-"
        rows.append([v.case, truth["source"], truth["what"], v.outcome, said, f"{v.seconds_cpu:.0f}"])
    return table(["case", "recording", "what was done", "outcome", "named (confidence)", "CPU s"], rows)
