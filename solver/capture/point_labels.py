"""Which points of a C3D file are markers, and what they are called."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from solver.capture.text_table import some_of, unique_names

UNLABELLED = re.compile(r"|\*.*|(unlabel+ed|unnamed|unknown|uname)[ _:*-]*\d*", re.IGNORECASE)
COMPUTED = re.compile(r"(.*[a-z0-9_. ])?(Angles?|Moments?|Forces?|Powers?|Scalars?|ProgressAngles?)")
SUBJECT_PREFIX = re.compile(r"(.+?):(.+)")


@dataclass(frozen=True)
class MarkerPoints:
    """The points that are markers: unique names, and the place of each among all points."""

    names: tuple[str, ...]
    columns: tuple[int, ...]
    notes: tuple[str, ...] = ()


def marker_points(
    labels: Sequence[str], seen_frames: Int[np.ndarray, " points"], computed: frozenset[str], source: str
) -> MarkerPoints:
    """Choose and name the markers; whatever is left out or renamed is said.

    Args:
        labels: of the points in order; fewer than points where the rest has none.
        seen_frames: on how many frames each point was seen.
        computed: labels that the file declares to be angles, forces, moments, powers or scalars.
        source: the file, for the notes.
    """
    named = [labels[k].strip() if k < len(labels) else "" for k in range(len(seen_frames))]
    columns = [k for k, label in enumerate(named) if not UNLABELLED.fullmatch(label)]
    unlabelled = len(named) - len(columns)
    notes: tuple[str, ...] = ()
    if unlabelled:
        notes += (f"{source}: {unlabelled} unlabelled trajectories are left out",)

    def is_computed(label: str) -> bool:
        return label in computed or bool(COMPUTED.fullmatch(label))

    derived = [named[k] for k in columns if is_computed(named[k])]
    if derived:
        notes += (f"{source}: {len(derived)} computed quantities, not markers: {some_of(derived, 3)}",)
    columns = [k for k in columns if not is_computed(named[k])]

    columns, short, prefix_notes = _without_subject({k: named[k] for k in columns}, seen_frames, source)
    columns, twin_notes = _seen_twins(columns, short, seen_frames, source)
    names, repeated = unique_names([short[k] for k in columns])
    if repeated:
        twin_notes += (
            f"{source}: more than one marker is called {', '.join(repeated)}; "
            "the later ones are called name#2, name#3, …",
        )
    return MarkerPoints(names, tuple(columns), notes + prefix_notes + twin_notes)


def _without_subject(
    labels: dict[int, str], seen_frames: Int[np.ndarray, " points"], source: str
) -> tuple[list[int], dict[int, str], tuple[str, ...]]:
    """Labels without "Subject:"; of several subjects the one that was seen most."""
    parts = {k: SUBJECT_PREFIX.fullmatch(label) for k, label in labels.items()}
    prefixes = Counter[str]()
    for k, part in parts.items():
        if part:
            prefixes[part[1]] += int(seen_frames[k])
    if not prefixes:
        return list(labels), labels, ()
    subject = max(prefixes, key=lambda name: prefixes[name])
    short = {k: part[2].strip() if part else labels[k] for k, part in parts.items()}
    note = f"{source}: the subject's name '{subject}:' is removed from the labels"
    bare = {labels[k] for k, part in parts.items() if part is None}
    belongs = [k for k, part in parts.items() if part is None or part[1] == subject]
    others = [name for name in prefixes if name != subject]
    if not others:
        return belongs, short, (note,)
    mine = {short[k] for k in belongs if parts[k]} | bare
    if all(short[k] not in mine for k in labels if k not in belongs):
        return (
            list(labels),
            short,
            (f"{source}: the names {', '.join(prefixes)} are removed from the labels",),
        )
    note_others = f"{source}: the markers of {', '.join(others)} are left out: another subject"
    return belongs, short, (note, note_others)


def _seen_twins(
    columns: Sequence[int], short: dict[int, str], seen_frames: Int[np.ndarray, " points"], source: str
) -> tuple[list[int], tuple[str, ...]]:
    """Without the points that were never seen while another one of the same name was."""
    seen = {short[k] for k in columns if seen_frames[k]}
    kept = [k for k in columns if seen_frames[k] or short[k] not in seen]
    empty = [short[k] for k in columns if k not in kept]
    if not empty:
        return kept, ()
    return kept, (f"{source}: never seen, beside another marker of the same name: {', '.join(empty)}",)
