"""Which points of a C3D file are markers, and what they are called."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from solver.capture.formats.text_table import number_repeats, some_of
from solver.common.notes import Kind, Note, noted

UNLABELLED = re.compile(r"|\*.*|(unlabel+ed|unnamed|unknown|uname)[ _:*-]*\d*", re.IGNORECASE)
COMPUTED = re.compile(r"(.*[a-z0-9_. ])?(Angles?|Moments?|Forces?|Powers?|Scalars?|ProgressAngles?)")


@dataclass(frozen=True)
class MarkerPoints:
    """The points that are markers: unique names, and the place of each among all points."""

    names: tuple[str, ...]
    columns: tuple[int, ...]
    notes: tuple[Note, ...] = ()


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
    notes: tuple[Note, ...] = ()
    if unlabelled:
        notes += noted(Kind.LABELS, f"{source}: {unlabelled} unlabelled trajectories are left out")

    def is_computed(label: str) -> bool:
        return label in computed or bool(COMPUTED.fullmatch(label))

    derived = [named[k] for k in columns if is_computed(named[k])]
    if derived:
        notes += noted(
            Kind.LABELS, f"{source}: {len(derived)} computed quantities, not markers: {some_of(derived, 3)}"
        )
    columns = [k for k in columns if not is_computed(named[k])]

    columns, counterpart_notes = _seen_counterparts(columns, named, seen_frames, source)
    names, repeated_notes = number_repeats([named[k] for k in columns], source)
    return MarkerPoints(names, tuple(columns), notes + counterpart_notes + repeated_notes)


def _seen_counterparts(
    columns: Sequence[int], names: Sequence[str], seen_frames: Int[np.ndarray, " points"], source: str
) -> tuple[list[int], tuple[Note, ...]]:
    """Without the points that were never seen while another one of the same name was."""
    seen = {names[k] for k in columns if seen_frames[k]}
    kept = [k for k in columns if seen_frames[k] or names[k] not in seen]
    empty = [names[k] for k in columns if k not in kept]
    if not empty:
        return kept, ()
    return kept, noted(
        Kind.LEFT_OUT, f"{source}: never seen, beside another marker of the same name: {', '.join(empty)}"
    )
