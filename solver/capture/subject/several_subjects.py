"""Labels of several subjects in one recording: `name:label` in programs' words, `name_label` in people's."""

import re
from collections import defaultdict
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from solver.capture.capture import Markers
from solver.common.notes import Kind, Note, noted

SIDES = frozenset({"l", "r", "left", "right"})  # before a colon they are no one's name
LEAST_SHARED = 5  # labels that two subjects have in common
LEAST_PAIRS = 3  # left and right labels among them, where the sign after a name means other things too
SIGN = re.compile(r"([^-_. ]+)[-_. ]+(.+)")
TWICE_M = 0.02  # nearer in the median, they are the same markers written twice


@dataclass(frozen=True)
class OneSubject:
    """The markers of one subject of a recording, without the name before their labels."""

    markers: Markers
    name: str = ""  # before its labels
    others: tuple[str, ...] = ()  # names of the other people
    notes: tuple[Note, ...] = ()


def one_subject(markers: Markers, wanted: str | None = None) -> OneSubject:
    """The subject that is wanted, else the one that the recording has most of, and a note on the others.

    Others are people too where most of their labels are the first one's but for the name. Left in, they
    would be taken for what the model has besides, or for other spellings of the same marker. What is no
    person, a bar say, stays, but for labels that the person has.

    Args:
        markers: as recorded.
        wanted: the name before a subject's labels; of no one who is in the recording, it decides nothing.
    """
    own: dict[str, dict[str, int]] = defaultdict(dict)
    parts = _parts(markers.names)
    short = [label for _, label in parts]
    for column, (whose, label) in enumerate(parts):
        own[whose][label.casefold()] = column
    if not own.keys() - {""}:
        return OneSubject(markers)
    seen = np.isfinite(markers.positions_ground).all(axis=2).sum(axis=0)
    kept = max(own, key=lambda whose: (whose == wanted, sum(int(seen[c]) for c in own[whose].values())))
    people = [whose for whose in own if whose != kept and _is_a_subject(own[whose], own[kept])]
    left_out = {column for whose in people for column in own[whose].values()}
    doubled = {
        column
        for whose in own
        if whose != kept
        for label, column in own[whose].items()
        if column not in left_out and label in own[kept]
    }
    stay = [c for c in range(len(markers.names)) if c not in left_out | doubled]
    one = replace(markers.chosen(stay), names=tuple(short[c] for c in stay))
    twice = [whose for whose in people if _apart_m(markers, own, kept, whose) < TWICE_M]
    others = tuple(whose for whose in people if whose not in twice)
    notes = tuple(
        Note(
            Kind.OTHER,
            f"{len(own[whose])} markers of {_called(whose)} are those of {_called(kept)} written twice; "
            "left out",
        )
        for whose in twice
    )
    if others and kept == wanted:
        notes += noted(
            Kind.PLATES,
            f"the markers of {', '.join(map(_called, others))} are left out, as subject.toml says",
        )
    elif others:
        notes += (_people_note(markers, own, kept, others),)
    if doubled:
        named = ", ".join(markers.names[c] for c in sorted(doubled))
        notes += noted(Kind.OTHER, f"left out, since {_called(kept)} has labels of these names: {named}")
    removed = [whose for whose in own if whose and whose not in people]
    if removed:
        notes += noted(Kind.LABELS, f"the name {', '.join(removed)} is removed from the labels")
    return OneSubject(one, kept, others, notes)


def _parts(names: Sequence[str]) -> list[tuple[str, str]]:
    """The name of a subject and the label; no name where none is told."""
    at_colons = []
    for name in names:
        whose, label = (part.strip() for part in name.rpartition(":")[::2])
        at_colons.append((whose, label) if label and whose.casefold() not in SIDES else ("", name))
    if any(whose for whose, _ in at_colons):
        return at_colons
    at_signs = [found.groups() if (found := SIGN.fullmatch(name)) else ("", name) for name in names]
    labels: dict[str, set[str]] = defaultdict(set)
    for whose, label in at_signs:
        labels[whose].add(label.casefold())
    people = {
        whose
        for pair in combinations(labels.keys() - {""}, 2)
        if _pairs(labels[pair[0]] & labels[pair[1]]) >= LEAST_PAIRS
        for whose in pair
    }
    return [
        (whose, label) if whose in people else ("", name)
        for (whose, label), name in zip(at_signs, names, strict=True)
    ]


def _pairs(labels: Set[str]) -> int:
    return sum(label[0] == "l" and f"r{label[1:]}" in labels for label in labels)


def _is_a_subject(labels: dict[str, int], first: dict[str, int]) -> bool:
    shared = len(labels.keys() & first.keys())
    return shared >= LEAST_SHARED and 2 * shared >= len(labels)


def _called(whose: str) -> str:
    return whose or "no name"


def _apart_m(markers: Markers, own: dict[str, dict[str, int]], kept: str, whose: str) -> float:
    """How far the same labels of two subjects are from each other; NaN where they are never seen together."""
    shared = sorted(own[whose].keys() & own[kept].keys())
    one, other = (markers.positions_ground[:, [own[w][label] for label in shared]] for w in (kept, whose))
    apart = np.linalg.norm(other - one, axis=2)
    return float(np.nanmedian(apart)) if np.isfinite(apart).any() else float("nan")


def _people_note(
    markers: Markers, own: dict[str, dict[str, int]], kept: str, others: tuple[str, ...]
) -> Note:
    told = []
    for whose in others:
        apart_m = _apart_m(markers, own, kept, whose)
        far = f", {apart_m:.1f} m away" if np.isfinite(apart_m) else ""
        told.append(f"{_called(whose)} ({len(own[whose])} markers{far})")
    return Note(
        Kind.SEVERAL_PEOPLE,
        f"{1 + len(others)} people in one file: {_called(kept)} ({len(own[kept])} markers) is taken, "
        f'{", ".join(told)} left out. To take another: prefix = "{others[0]}" in subject.toml; '
        "addb-viewer init writes one for each",
    )
