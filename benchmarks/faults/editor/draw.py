"""A draw of cases: kinds of faults with their sizes, folders as handed in, and the truth elsewhere."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.faults.editor import edits, plates
from benchmarks.faults.editor.recording import Edit, Fault, NoPlaceError, Recording, write_folder
from benchmarks.faults.editor.sources import SOURCES, Source

WALKS = ("walk", "run")
MOVING = ("walk", "run", "jump", "squat")
ANY = ("walk", "run", "jump", "squat", "stand")
CLEAN = "clean"


@dataclass(frozen=True)
class Kind:
    """One kind of fault."""

    name: str
    draw: Callable[[np.random.Generator], Edit]
    cases: int  # of a draw
    activities: Sequence[str] = ANY
    trials: int | None = None  # that a recording must have; None: one or more


def _either(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def _two_lags(rng: np.random.Generator) -> Edit:
    first = rng.uniform(0.005, 0.03)
    return edits.late([first, first + rng.uniform(0.006, 0.03)])


KINDS = (
    Kind("tared_under_load", lambda r: plates.tared_under_load(r.uniform(300, 1000), _either(r, 0, 0.1)), 4),
    Kind(
        "zero_level",
        lambda r: plates.zero_level((_either(r, 5, 30), _either(r, 60, 200), _either(r, 5, 30))),
        3,
    ),
    Kind("turned_half", lambda r: plates.turned(180.0), 3, MOVING),
    Kind("turned_quarter", lambda r: plates.turned(float(r.choice([-90.0, 90.0]))), 3, MOVING),
    Kind("mirrored", lambda r: plates.mirrored(int(r.choice([0, 2]))), 3, MOVING),
    Kind("shifted", lambda r: plates.shifted(r.uniform(0.12, 0.25), r.uniform(0, 360)), 4),
    Kind("pounds", lambda r: plates.pounds(), 3),
    Kind("half_gain", lambda r: plates.gain(0.5), 3),
    Kind("quarter_gain", lambda r: plates.gain(0.25), 2),
    Kind("sign", lambda r: plates.sign(), 3),
    Kind("exchanged_plates", lambda r: plates.exchanged(), 2, ("walk", "squat", "stand")),
    Kind("late", lambda r: edits.late([r.uniform(0.015, 0.15)]), 4, MOVING, 1),
    Kind("two_lags", _two_lags, 2, MOVING, 2),
    Kind("one_plate_late", lambda r: edits.one_plate_late(r.uniform(0.015, 0.06)), 2, WALKS),
    Kind("drift", lambda r: edits.drifting(_either(r, 0.012, 0.04)), 2, WALKS, 1),
    Kind("filtered", lambda r: edits.smoothed(r.uniform(4.0, 6.0)), 3, WALKS),
    Kind("lost_step", lambda r: plates.lost_step(), 4, WALKS),
    Kind(
        "object_on_plate", lambda r: plates.standing_object(r.uniform(6, 10), _either(r, 0.15, 0.25)), 3, ANY
    ),
    Kind("other_mass", lambda r: edits.somebody_elses_mass(float(r.choice([0.8, 1.25]))), 3),
    Kind("support", lambda r: edits.supported(r.uniform(0.1, 0.3)), 2, ("walk", "stand")),
    Kind("marker_slip", lambda r: edits.slipped(r.uniform(0.025, 0.045)), 3),
    Kind("exchanged_labels", lambda r: edits.labels_exchanged(r.uniform(0.3, 0.6)), 3),
    Kind("cloth", lambda r: edits.carried_by_cloth(r.uniform(0.02, 0.035)), 3),
)
HARMLESS = (
    lambda r: edits.as_it_is(),
    lambda r: edits.axes_turned(float(r.uniform(0, 360)), *r.uniform(-2, 2, 2)),
    lambda r: edits.part(float(r.uniform(0.0, 0.15)), float(r.uniform(0.85, 1.0))),
    lambda r: edits.fewer_force_samples(),
)


@dataclass(frozen=True)
class Case:
    """One recording, and what was done to it."""

    name: str
    kind: str
    source: Source
    recording: Recording
    fault: Fault


def make(
    out: Path, data: Path, seed: int, times: int = 1, kinds: Sequence[str] = (), *, lower_body: bool = False
) -> int:
    """Write subjects/CASE and truth/CASE.json; those that are there stay. How many cases there are.

    Args:
        out: folder of the draw.
        data: folder of all real recordings.
        seed: of the draw.
        times: as many cases of every kind of fault as stand in `KINDS`, so many times.
        kinds: only these, and `clean`; none: all.
        lower_body: without the markers of trunk, arms and head, and faults of those.
    """
    cases = [case for case in drawn(data, seed, times) if not kinds or case.kind in kinds]
    if lower_body:
        cases = [
            replace(case, recording=edits.lower_body(case.recording)) for case in cases if _is_below(case)
        ]
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


def _is_below(case: Case) -> bool:
    """Whether its fault is not of a marker above the pelvis."""
    return not any(edits.ABOVE_PELVIS.search(label) for label in case.fault.markers)


def _clean(source: Source, recording: Recording, edit: Edit, rng: np.random.Generator) -> Case:
    try:
        changed, fault = edit(recording, rng)
    except NoPlaceError:
        changed, fault = HARMLESS[1](rng)(recording, rng)
    return Case("", CLEAN, source, changed, fault)


def _fits(kind: Kind, source: Source) -> bool:
    return source.activity in kind.activities and kind.trials in (None, len(source.stretches))
