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


def main() -> None:
    """Make what is missing, answer it, print a row for each recording."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.small_faults", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default="", help="part of a fault's name")
    given = parser.parse_args()
    cases = _make(given.out, given.only)
    run_all(given.out, limit_s=CPU_LIMIT_S, only="", workers=1)
    print(f"| recording | {' | '.join(dict.fromkeys(fault for _, fault, _ in cases))} |")
    rows: dict[str, list[str]] = {}
    for name, _, source in cases:
        answer = json.loads((given.out / "results" / f"{name}.json").read_text())
        rows.setdefault(source, []).append(_said(answer["diagnosis"]))
    for source, said in rows.items():
        print(f"| {source} | {' | '.join(said)} |")


def _make(out: Path, only: str) -> list[tuple[str, str, str]]:
    """Case, fault and source of each."""
    cases = []
    for source in (s for s in SOURCES if len(s.stretches) == 1):
        recording = source.read(data_folder())
        for fault, edit in FAULTS.items():
            if only not in fault:
                continue
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
