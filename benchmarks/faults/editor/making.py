"""A draw of cases: folders as one hands them in, and what is true of them in another place."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.faults.editor.fault import Edit, Fault, NoPlaceError
from benchmarks.faults.editor.files import write_folder
from benchmarks.faults.editor.kinds import CLEAN, HARMLESS, KINDS, Kind
from benchmarks.faults.editor.recording import Recording
from benchmarks.faults.editor.sources import SOURCES, Source


@dataclass(frozen=True)
class Case:
    """One recording, and what was done to it."""

    name: str
    kind: str
    source: Source
    recording: Recording
    fault: Fault


def make(out: Path, data: Path, seed: int, times: int = 1, kinds: Sequence[str] = ()) -> int:
    """Write subjects/CASE and truth/CASE.json; those that are there stay. How many cases there are.

    Args:
        out: folder of the draw.
        data: folder of all real recordings.
        seed: of the draw.
        times: as many cases of every kind of fault as stand in `KINDS`, so many times.
        kinds: only these, and `clean`; none: all.
    """
    cases = [case for case in drawn(data, seed, times) if not kinds or case.kind in kinds]
    order = np.random.default_rng(seed).permutation(len(cases))
    (out / "truth").mkdir(parents=True, exist_ok=True)
    for number, case in zip(order, cases, strict=True):
        name = f"case_{number:03d}"
        truth = out / "truth" / f"{name}.json"
        if truth.exists():
            continue
        write_folder(out / "subjects" / name, case.recording)
        about = {"case": name, "kind": case.kind, "source": case.source.name, "person": case.source.person}
        about |= {"activity": case.source.activity, **asdict(case.fault)}
        truth.write_text(json.dumps(about, indent=1) + "\n")
    return len(cases)


def drawn(data: Path, seed: int, times: int = 1) -> Iterator[Case]:
    """Clean ones, each source as it is and twice changed without harm; then faults, `times` over."""
    rng = np.random.default_rng(seed)
    read = {source.name: source.read(data) for source in SOURCES}
    for k, source in enumerate(SOURCES):
        others = [change for n, change in enumerate(HARMLESS[1:]) if n != k % (len(HARMLESS) - 1)]
        for change in (HARMLESS[0], *others):
            yield _clean(source, read[source.name], change(rng), rng)
    turn = 0
    for kind in KINDS:
        fit = [s for s in SOURCES if _fits(kind, s)]
        made = 0
        wanted = times * kind.cases
        for tried in range(3 * wanted * len(fit)):
            if made == wanted:
                break
            source = fit[(turn + tried) % len(fit)]
            try:
                recording, fault = kind.draw(rng)(read[source.name], rng)
            except NoPlaceError:
                continue
            made += 1
            yield Case("", kind.name, source, recording, fault)
        turn += wanted + 1


def _clean(source: Source, recording: Recording, edit: Edit, rng: np.random.Generator) -> Case:
    try:
        changed, fault = edit(recording, rng)
    except NoPlaceError:
        changed, fault = HARMLESS[1](rng)(recording, rng)
    return Case("", CLEAN, source, changed, fault)


def _fits(kind: Kind, source: Source) -> bool:
    return source.activity in kind.activities and kind.trials in (None, len(source.stretches))
