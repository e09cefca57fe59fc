"""What labels are read as, against models whose markers others put on bodies; and which numbers decide it.

    python -m benchmarks.marker_labels --out DIR

Marker sets of laboratories' own models in the recorded folders, and of published models: each label is read
as if there were no model, by its name alone and, where there are recordings, with its distances to the
others; then with some of the trajectories exchanged, whose labels are to be left out. Right is the same part
of the body as in the model. Then every tuned number of `solver/markers` that labels are read with is halved
and doubled. Answers are kept as lines of a file in DIR: it picks up where it was stopped, then writes
MARKER_LABELS.md.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.recordings import data_folder, recordings_of, subjects
from benchmarks.register import tuned_numbers
from benchmarks.rewriting import NoAnswerError, Number, answer_with
from benchmarks.varied import FACTORS, Answer, asked, number_tables, rules
from solver.capture.capture import Markers, Subject
from solver.errors import SolverError
from solver.markers.understanding import understand
from solver.skeleton.osim import load_skeleton

MODULE = "benchmarks.marker_labels"
PAGE = Path(__file__).with_name("MARKER_LABELS.md")
NOT_ASKED = ("markers/people.py",)  # how many people a recording shows
FEWEST = 10  # labels that a set needs
NOT_READ = "-"
USUAL = "Labels"
MOST_TOLD = 6  # wrong ones, by name
PARTS = {
    "foot": ("talus", "calcn", "toes"),
    "shank": ("tibia", "patella"),
    "thigh": ("femur",),
    "upper arm": ("humerus",),
    "forearm": ("radius", "ulna"),
    "hand": ("hand",),
}  # of a side; where a marker of a wrist or a toe belongs is a matter of the model
BY_NAME, BY_DISTANCE, EXCHANGED = "name", "name and distances", "the same, a fifth exchanged"
SHARE, SEED = 0.2, 0  # of the labels that are exchanged
INTRODUCTION = """# What labels are read as, against models that others made

Made by `python -m benchmarks.marker_labels`. Each set is that of a laboratory's own model, or of a published
one, whose maker put each marker on a body. Its labels are read as if there were no model: by name alone, with
the recordings' distances, and with a fifth of the trajectories exchanged with one of another part, whose
labels are to be left out. *Right*: the same part of the body (foot, shank, thigh, pelvis, trunk with head,
upper arm, forearm, hand; and the side). *Left out*: not sure enough to be used.

{sets}

Then every tuned number of `solver/markers` that labels are read with is halved and doubled. A row has the
share of labels that are not right (those left out count half) of {count}, and the share that is read
otherwise.

"""


@dataclass(frozen=True)
class LabelSet:
    """Labels of one model, the part that each is on, and recordings of them."""

    name: str
    part: dict[str, str]  # by label
    recordings: tuple[Markers, ...]


def part_of(body: str) -> str:
    """The part of the body that a model's body belongs to, with its side."""
    stem, _, side = body.rpartition("_")
    for part, bodies in PARTS.items():
        if stem in bodies and side in ("r", "l"):
            return f"{part} {side}"
    return "trunk" if body in ("torso", "head") else body


@cache
def label_sets() -> tuple[LabelSet, ...]:
    """Each set of labels once."""
    found: dict[frozenset[str], LabelSet] = {}
    for one in (*_recorded(), *_published()):
        if len(one.part) >= FEWEST:
            found.setdefault(frozenset(one.part), one)
    return tuple(found.values())


def _recorded() -> Iterator[LabelSet]:
    for name, subject in subjects():
        if isinstance(subject, Subject) and subject.model is not None:
            try:
                on_body = _parts(subject.model)
                recordings = recordings_of(subject, subject.trials[0].name) if subject.trials else []
            except SolverError:
                continue
            labels = {label for recording in recordings for label in recording.names}
            yield LabelSet(name, {n: p for n, p in on_body.items() if n in labels}, tuple(recordings))


def _published() -> Iterator[LabelSet]:
    for path in sorted((data_folder() / "models").glob("*.osim")):
        try:
            yield LabelSet(path.name, _parts(path), ())
        except SolverError:
            continue


def _parts(model: Path) -> dict[str, str]:
    skeleton = load_skeleton(model)
    return {marker.name: part_of(skeleton.bodies[marker.body].name) for marker in skeleton.markers}


def ways_of(one: LabelSet) -> tuple[str, ...]:
    """In which its labels can be read."""
    return (BY_NAME, BY_DISTANCE, EXCHANGED) if one.recordings else (BY_NAME,)


def exchanges(one: LabelSet) -> dict[str, str]:
    """Pairs of labels on different parts, each by the other; drawn by a seed."""
    rng, found = np.random.default_rng(SEED), {}
    labels = sorted(one.part)
    while len(found) < SHARE * len(labels):
        a, b = (labels[k] for k in rng.choice(len(labels), 2, replace=False))
        if a not in found and b not in found and one.part[a] != one.part[b]:
            found |= {a: b, b: a}
    return found


def read_as(one: LabelSet, way: str) -> dict[str, str]:
    """By label of the set, the part that it is read as."""
    recordings: Sequence[Markers] = () if way == BY_NAME else one.recordings
    if way == EXCHANGED:
        other = exchanges(one)
        recordings = [replace(m, names=tuple(other.get(n, n) for n in m.names)) for m in recordings]
    labels = [name for markers in recordings for name in markers.names] or list(one.part)
    rows = understand(labels, recordings).by_label()
    used = {label: row.body for label, row in rows.items() if row.used or row.same_as is not None}
    return {label: part_of(used[label] or NOT_READ) if label in used else NOT_READ for label in one.part}


def right_parts(one: LabelSet, way: str) -> dict[str, str]:
    """By label, the part that it should be read as; of what is exchanged, none."""
    return one.part | (dict.fromkeys(exchanges(one), NOT_READ) if way == EXCHANGED else {})


def everything_read() -> list[list[str]]:
    """All sets' labels in order, each in every way, in this process."""
    return [[*read_as(one, way).values()] for one in label_sets() for way in ways_of(one)]


def not_right(read: Sequence[Sequence[str]]) -> dict[str, float]:
    """By set, what it has in the share of labels that are not right; those that are left out count half."""
    sets = [(one, way) for one in label_sets() for way in ways_of(one)]
    found = {one.name: 0.0 for one in label_sets()}
    for (one, way), ours in zip(sets, read, strict=True):
        pairs = zip(ours, right_parts(one, way).values(), strict=True)
        found[one.name] += sum(0.0 if o == right else 0.5 if o == NOT_READ else 1.0 for o, right in pairs)
    count = sum(map(len, read))
    return {name: cost / count for name, cost in found.items()}


@cache
def _usual() -> list[list[str]]:
    return everything_read()


def answered(number: Number, factor: float) -> Answer:
    """Of one number at another value."""
    name = number.called
    try:
        read = answer_with(number, factor, everything_read, {})
    except NoAnswerError as error:
        print(f"{name} × {factor:g}: {error}", flush=True)
        return Answer(name, factor, 1.0, 1.0)
    before = [one for of_set in _usual() for one in of_set]
    now = [one for of_set in read for one in of_set]
    changed = np.mean([one != other for one, other in zip(before, now, strict=True)])
    wrong = not_right(read)
    return Answer(name, factor, sum(wrong.values()), float(changed), len(now), wrong)


def sets_table() -> str:
    """A row a set and a way of reading."""
    lines = ["| set | labels | read by | right | left out | another part |", "|---|---:|---|---:|---:|---|"]
    for one in label_sets():
        for way in ways_of(one):
            read, right = read_as(one, way), right_parts(one, way)
            wrong = [f"{n}: {part}" for n, part in read.items() if part not in (right[n], NOT_READ)]
            counts = [sum(read[n] == part for n, part in right.items())]
            counts.append(sum(part == NOT_READ != right[n] for n, part in read.items()))
            told = "; ".join(wrong) if len(wrong) <= MOST_TOLD else f"{len(wrong)} labels"
            lines.append(f"| {one.name} | {len(read)} | {way} | {counts[0]} | {counts[1]} | {told} |")
    return "\n".join(lines)


def _possible(answers: Sequence[Answer]) -> list[Answer]:
    """Without the numbers with which nothing can be read, at half and at double."""
    read = {one.setting for one in answers if one.of}
    return [one for one in answers if one.setting in read]


def main() -> None:
    """Ask what has no answer yet, and write the page."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder in which answers are kept")
    given = parser.parse_args()
    numbers = [number for number in tuned_numbers(("markers/",)) if number.file not in NOT_ASKED]
    waiting = [(n.called, factor, n) for n in numbers for factor in FACTORS]
    answers = asked(given.out / "labels.jsonl", waiting, lambda v: answered(v[2], v[1]))
    count = sum(map(len, _usual()))
    wrong = not_right(_usual())
    usual = Answer(USUAL, 1.0, sum(wrong.values()), 0.0, count, wrong)
    text = INTRODUCTION.format(sets=sets_table(), count=count)
    PAGE.write_text(
        "\n".join([text + rules("set of labels"), "", *number_tables(_possible(answers), usual)]),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
