"""Whether a subject's recordings are of one person: lengths between bony landmarks tell people apart.

Only distances that no posture changes count: within a segment, or from a knee's to an ankle's marker. Markers
that were placed again move them by a centimetre, another person by a few per cent of every bone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from solver.capture.body_lengths import Lengths, body_lengths, odds_for_two
from solver.capture.capture import Markers
from solver.markers.atlas import atlas
from solver.markers.distances import posture_scatter_m
from solver.markers.understanding import understand

RIGID_M = 0.015  # scatter of a landmarks' distance over postures: what a knee's axis leaves to its markers
TWO_PEOPLE = 2.3  # [log odds] 10 to 1; of the shared recordings of one person none is above 1.0
LITTLE_DOUBT = 7.0  # [log odds] no figure beyond it means anything
WORDS = {2: "two", 3: "three", 4: "four"}


@dataclass(frozen=True)
class _Group:
    """Recordings of one person, by their places in the list."""

    members: tuple[int, ...]


def people_notes(recordings: Mapping[str, Markers]) -> tuple[str, ...]:
    """A note where recordings seem to be of several people; none where they agree or cannot be compared.

    Args:
        recordings: by name, the static trial among them.
    """
    names = list(recordings)
    lengths = _bony_lengths(list(recordings.values()))
    odds = {}
    for i, j in combinations(range(len(names)), 2):
        found = odds_for_two(lengths[i], lengths[j])
        if found is not None:
            odds[i, j] = found
    groups = _grouped(len(names), odds)
    if len(groups) < 2:
        return ()
    told = " | ".join(", ".join(names[i] for i in group.members) for group in groups)
    between = [value for pair, value in odds.items() if not any(set(pair) <= set(g.members) for g in groups)]
    off, likelier = _typically_off(lengths, groups), float(np.mean(between))
    sure = f"{np.exp(likelier):.0f} to 1" if likelier < LITTLE_DOUBT else "more than 1000 to 1"
    return (
        f"these trials seem to be of {WORDS.get(len(groups), str(len(groups)))} people: {told} (lengths "
        f"of the body differ by {1000 * off:.0f} mm in the median, odds of {sure} against markers placed "
        "again). One skeleton is fitted to all: give each person a folder of their own",
    )


def _bony_lengths(recordings: Sequence[Markers]) -> list[Lengths]:
    """Each recording's lengths between bony landmarks whose distance no posture changes."""
    labels = dict.fromkeys(name for markers in recordings for name in markers.names)
    landmark = {
        row.label: row.landmark
        for row in understand(list(labels)).labels
        if row.landmark is not None and row.used and not atlas()[row.landmark].tracks_only
    }
    found = []
    for markers in recordings:
        kept = [i for i, name in enumerate(markers.names) if name in landmark]
        bony = replace(
            markers,
            names=tuple(markers.names[i] for i in kept),
            positions_ground=markers.positions_ground[:, kept],
        )
        found.append(
            {
                (one, other): length
                for (one, other), length in body_lengths(bony).items()
                if posture_scatter_m(landmark[one], landmark[other]) < RIGID_M
            }
        )
    return found


def _grouped(count: int, odds: Mapping[tuple[int, int], float]) -> list[_Group]:
    """Recordings joined, the likest first, while two people are not clearly likelier; mean over all pairs."""
    groups = [_Group((i,)) for i in range(count)]

    def apart(one: _Group, other: _Group) -> float:
        known = [
            odds[pair] for i in one.members for j in other.members if (pair := (min(i, j), max(i, j))) in odds
        ]
        return float(np.mean(known)) if known else 0.0

    while len(groups) > 1:
        one, other = min(combinations(groups, 2), key=lambda pair: apart(*pair))
        if apart(one, other) >= TWO_PEOPLE:
            break
        joined = _Group(tuple(sorted((*one.members, *other.members))))
        groups = [group for group in groups if group not in (one, other)] + [joined]
    return sorted(groups, key=lambda group: group.members)


def _typically_off(lengths: Sequence[Lengths], groups: Sequence[_Group]) -> float:
    """Median difference of lengths between recordings of different groups [m]."""
    off = [
        abs(lengths[i][pair] - lengths[j][pair])
        for one, other in combinations(groups, 2)
        for i in one.members
        for j in other.members
        for pair in lengths[i].keys() & lengths[j].keys()
    ]
    return float(np.median(off))
