"""Labels of several subjects in one recording: programs write them as `name:label`."""

from collections import defaultdict
from dataclasses import replace

import numpy as np

from solver.capture.capture import Markers

SIDES = frozenset({"l", "r", "left", "right"})  # before a colon they are no one's name
LEAST_SHARED = 5  # labels that two subjects have in common
TWICE_M = 0.02  # nearer in the median, they are the same markers written twice


def one_subject(markers: Markers) -> tuple[Markers, tuple[str, ...]]:
    """The labels of the subject that the recording has most of, and a note on those that are left out.

    Others are subjects too where most of their labels are the first one's but for the name. Left in, they
    would be taken for what the model has besides, or for other spellings of the same marker.

    Args:
        markers: as recorded.
    """
    own: dict[str, dict[str, int]] = defaultdict(dict)
    for column, name in enumerate(markers.names):
        whose, _, label = name.rpartition(":")
        own[whose.strip()][label.strip().casefold()] = column
    for whose in [w for w in own if w.casefold() in SIDES]:
        del own[whose]
    if len(own) < 2:
        return markers, ()
    seen = np.isfinite(markers.positions_ground).all(axis=2).sum(axis=0)
    kept = max(own, key=lambda whose: sum(int(seen[c]) for c in own[whose].values()))
    others = [whose for whose in own if whose != kept and _is_a_subject(own[whose], own[kept])]
    if not others:
        return markers, ()
    left_out = {column for whose in others for column in own[whose].values()}
    stay = [c for c in range(len(markers.names)) if c not in left_out]
    notes = tuple(_note(markers, own, kept, whose) for whose in others)
    return replace(
        markers,
        names=tuple(markers.names[c] for c in stay),
        positions_ground=markers.positions_ground[:, stay],
    ), notes


def _is_a_subject(labels: dict[str, int], first: dict[str, int]) -> bool:
    shared = len(labels.keys() & first.keys())
    return shared >= LEAST_SHARED and 2 * shared >= len(labels)


def _note(markers: Markers, own: dict[str, dict[str, int]], kept: str, whose: str) -> str:
    shared = sorted(own[whose].keys() & own[kept].keys())
    columns = [[own[w][label] for label in shared] for w in (kept, whose)]
    one, other = (markers.positions_ground[:, c] for c in columns)
    apart = np.linalg.norm(other - one, axis=2)
    apart_m = float(np.nanmedian(apart)) if np.isfinite(apart).any() else np.nan
    names = [f"'{w}'" if w else "no name" for w in (kept, whose)]
    if apart_m < TWICE_M:
        return f"{len(own[whose])} markers of {names[1]} are those of {names[0]} written twice; left out"
    far = f", {apart_m:.1f} m away," if np.isfinite(apart_m) else ""
    return (
        f"markers of several subjects: {len(own[kept])} of {names[0]} are used, and {len(own[whose])} of "
        f"{names[1]}{far} are left out. If the forces are theirs, give them a folder of their own, "
        "without the other's markers"
    )
