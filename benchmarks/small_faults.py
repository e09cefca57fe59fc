"""`python -m benchmarks.small_faults --out DIR`: what the diagnosis says of small faults in sound recordings.

One clock, one gain and one band in every single trial of `benchmarks.faults`; the editor shares no code with
the solver. DIR keeps answers, so that a run goes on where it was stopped.
"""

import argparse
import json
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.diagnosis.run import CPU_LIMIT_S, run_all
from benchmarks.faults.editor.bands import banded
from benchmarks.faults.editor.clocks import late
from benchmarks.faults.editor.fault import Edit, NoPlaceError
from benchmarks.faults.editor.files import write_folder
from benchmarks.faults.editor.plates import gain
from benchmarks.faults.editor.sources import SOURCES
from benchmarks.recordings import data_folder

FAULTS: dict[str, Callable[[], Edit]] = {
    "clock 10 ms": lambda: late([0.010]),
    "clock 15 ms": lambda: late([0.015]),
    "gain 5 %": lambda: gain(1.05),
    "gain 10 %": lambda: gain(1.10),
    "band": lambda: banded(80.0, 0.5, 1.2),
}
PAGE = """# Small faults in good recordings

Made by `python -m benchmarks.small_faults --out DIR --page benchmarks/SMALL_FAULTS.md`. The eleven single
trials that `benchmarks/faults/editor/sources.py` describes, one to three seconds each, are sound. An editor
that shares no code with the solver put into each: forces that are 10 or 15 ms late; one plate that reads 5 or
10 % too much; an elastic band from the pelvis to a fixed point 1.2 m behind its mean place (80 N/m, slack for
0.5 m: at most 57 to 138 N). The table shows what the diagnosis named, with its confidence; below 0.9 a name
is only a lead. *clean*: nothing was said. *unexplained*: something is wrong that has no name. What a
recording gets untouched stands in FAULTS.md.

{table}
"""


def main() -> None:
    """Make what is missing, answer it, print a row for each recording."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.small_faults", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--page", type=Path, help="also written as a page of its own")
    given = parser.parse_args()
    cases = _make(given.out)
    run_all(given.out, limit_s=CPU_LIMIT_S, only="", workers=1)
    table = _table(given.out, cases)
    if given.page:
        given.page.write_text(PAGE.format(table=table), encoding="utf-8")
    print(table)


def _table(out: Path, cases: list[tuple[str, str, str]]) -> str:
    """A row for each recording."""
    lines = [f"| recording | {' | '.join(FAULTS)} |", "|---" * (len(FAULTS) + 1) + "|"]
    said: dict[str, dict[str, str]] = {}
    for name, fault, source in cases:
        answer = json.loads((out / "results" / f"{name}.json").read_text())
        said.setdefault(source, {})[fault] = _said(answer["diagnosis"])
    for source, of in said.items():
        lines.append(f"| {source} | {' | '.join(of.get(fault, 'no place for it') for fault in FAULTS)} |")
    return "\n".join(lines)


def _make(out: Path) -> list[tuple[str, str, str]]:
    """Case, fault and source of each."""
    cases = []
    for source in (s for s in SOURCES if len(s.stretches) == 1):
        recording = source.read(data_folder())
        for fault, edit in FAULTS.items():
            name = f"{source.name} {fault}".replace(" ", "_").replace("%", "pc")
            try:
                changed, _ = edit()(recording, np.random.default_rng(zlib.crc32(name.encode())))
            except NoPlaceError as reason:
                print(f"{source.name}: {fault}: {reason}")
                continue
            folder = out / "subjects" / name
            if not folder.exists():
                write_folder(folder, changed)
            cases.append((name, fault, source.name))
    return cases


def _said(figures: dict | None) -> str:
    if figures is None:
        return "no answer"
    named = [f"{e['id']} {e['confidence']:.2f}" for e in figures["effects"]]
    return "; ".join(named) or str(figures["verdict"])


if __name__ == "__main__":
    main()
