"""The page of a run."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis.rates import rate, table
from benchmarks.faults.distance import undecidable
from benchmarks.faults.editor.kinds import CLEAN, KINDS
from benchmarks.faults.editor.sources import SOURCES
from benchmarks.faults.judge import FAULTED, UNTOUCHED, Verdict, judged, with_seconds
from benchmarks.faults.soundness import soundness

AGREE = 0.8  # correlation from which on a lag means something

PAGE = """# Known faults in real recordings

Made by `make bench-faults`, seed {seed}, {code}: {answered} of {planned} cases answered. Each is a sound
stretch of a real recording into whose files one fault was edited, by an editor that shares no code with the
solver (`benchmarks/faults/editor`); or one that was changed without harm (axes turned and moved, another
stretch, half the samples of force), or not at all. The program is asked as a person asks it:
`addb-viewer diagnose FOLDER --json FILE`. *Right*: the fault's name, at its place and within 30 % of its size
or three stated deviations; or corrected on reading, with a note that says so. *Class*: names that belong to
the same place and kind only (`names.py`), or no name, and the loudest direct check says so; right where the
answer lists at most three, the fault among them, and the recording tells no more (`distance.py`: D below
5 nats, from the edit itself). *Wrong*: any other name, and not the right one. A *lead* is no name: the answer
itself calls it likelier wrong than right. *Very sure*: a confidence of 97 % or more. Rates come with their
95 % interval (Wilson).
{note}
## All

{summary}

## By kind of fault

{kinds}

## What was left alone, by recording

{clean}

## Why these stretches are sound

By their raw files, without a model of the body (`soundness.py`). Every contact of a stretch is on a
plate: seen in markers and forces, frame by frame. *Carried*: mean force less what the markers' mean rise
asks for. *Empty*: what a plate without load reads. *Off*: typical distance of a loaded centre of pressure
from the nearest foot marker. *Lag*: of the forces behind the markers' acceleration, by correlation; the
method itself is good to about 12 ms, as soft tissue and shoes yield. Left out: a treadmill walk and a sprint
whose clocks stand off from all others by this measure, a landing whose plates carry half a person,
stretches with steps beside the plates. One doubt is open: in the standing recording pressures lie 8 to
11 cm before the ankles, no marker shows the trunk, and the file's moments contradict its pressures (they
were left out); whether the person leans or the plates are elsewhere, its files do not tell.

{sound}

## Case by case

{cases}
{also}"""

ANOTHER = """
## Another draw

Seed {seed}, {code}: {answered} of {planned} cases answered. {note}

{summary}

{kinds}

{clean}

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
        verdict = judged(truth, answer)
        if verdict.outcome == "class" and undecidable(out, truth, answer["diagnosis"]):
            verdict = replace(verdict, outcome="right", as_a_class=True)
        verdicts.append(verdict)
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


def page(out: Path, data: Path, also: Sequence[Path] = ()) -> str:
    """Markdown.

    Args:
        out: of the draw.
        data: all real recordings.
        also: other draws, told after it; what `note.txt` says of any stands above its figures.
    """
    verdicts = load(out)
    about = json.loads((out / "cases.json").read_text(encoding="utf-8"))
    return PAGE.format(
        seed=about["seed"],
        code=about["code"],
        answered=len(verdicts),
        planned=len(list((out / "truth").glob("*.json"))),
        summary=summary(verdicts),
        kinds=by_kind(verdicts),
        clean=_clean(out, verdicts),
        sound=_sound(data),
        cases=_cases(out, verdicts),
        note=f"\n{said}\n" if (said := _note(out)) else "",
        also="".join(_another(one) for one in also),
    )


def _note(out: Path) -> str:
    """What is to be said of a draw, if anything."""
    note = out / "note.txt"
    return note.read_text(encoding="utf-8").strip() if note.exists() else ""


def _another(out: Path) -> str:
    verdicts = load(out)
    about = json.loads((out / "cases.json").read_text(encoding="utf-8"))
    return ANOTHER.format(
        seed=about["seed"],
        code=about["code"],
        answered=len(verdicts),
        planned=len(list((out / "truth").glob("*.json"))),
        note=_note(out),
        summary=summary(verdicts),
        kinds=by_kind(verdicts),
        clean=_clean(out, verdicts),
        cases=_cases(out, verdicts),
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
        ["of them as a class that cannot be parted", rate(sum(v.as_a_class for v in faulted), len(faulted))],
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


def _sound(data: Path) -> str:
    rows = []
    for source in SOURCES:
        for stretch, trial in zip(source.stretches, source.read(data).trials, strict=True):
            found = soundness(trial)
            rows.append(
                [
                    source.name,
                    f"`{source.person}/{stretch.markers}` {stretch.start_s:g} to {stretch.end_s:g} s",
                    "" if source.mass_kg is None else f"{source.mass_kg:.1f}",
                    f"{found.carried_kg:.1f}",
                    f"{found.unloaded_N:.1f}",
                    f"{100 * found.off_m:.1f}",
                    f"{1e3 * found.lag_s:+.0f} ({found.agreement:.2f})" if found.agreement > AGREE else "-",
                ]
            )
    head = ["recording", "stretch", "entered [kg]", "carried [kg]", "empty [N]", "off [cm]", "lag [ms] (r)"]
    return table(head, rows)


def _cases(out: Path, verdicts: Sequence[Verdict]) -> str:
    rows = []
    for v in sorted(verdicts, key=lambda v: (v.kind, v.case)):
        truth = truth_of(out, v.case)
        said = "; ".join(v.named) or "-"
        rows.append([v.case, truth["source"], truth["what"], v.outcome, said, f"{v.seconds_cpu:.0f}"])
    return table(["case", "recording", "what was done", "outcome", "named (confidence)", "CPU s"], rows)
