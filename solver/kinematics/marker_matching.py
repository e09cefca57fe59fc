"""Which measured markers the model knows, by name."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.errors import FitError
from solver.skeleton.skeleton import Skeleton

FEWEST_SHARED = 6  # below it a pose is not determined in any useful sense


@dataclass(frozen=True)
class MarkerMatch:
    """Shared markers: `measured[i]` is what the recording calls the model's marker `model[i]`."""

    model: tuple[str, ...]
    measured: tuple[str, ...]
    notes: tuple[str, ...]

    def observed(self, markers: Markers) -> Float[np.ndarray, "frames markers 3"]:
        """The recording's positions of the shared markers [m]; NaN for those this trial lacks."""
        observed = np.full((markers.frames, len(self.model), 3), np.nan)
        column = {name: i for i, name in enumerate(markers.names)}
        for i, name in enumerate(self.measured):
            if name in column:
                observed[:, i] = markers.positions_ground[:, column[name]]
        return observed

    def skeleton(self, skeleton: Skeleton) -> Skeleton:
        """The skeleton with just the shared markers, in their order."""
        by_name = {m.name: m for m in skeleton.markers}
        return skeleton.with_markers([by_name[name] for name in self.model])

    def seen_in(self, recordings: Sequence[Markers]) -> "MarkerMatch":
        """Without markers that none of these recordings ever saw."""
        seen = np.zeros(len(self.model), dtype=bool)
        for markers in recordings:
            seen |= np.isfinite(self.observed(markers)).all(axis=2).any(axis=0)
        keep = np.flatnonzero(seen)
        lost = [self.measured[i] for i in np.flatnonzero(~seen)]
        notes = self.notes + ((f"never seen in any frame, so left out: {', '.join(lost)}",) if lost else ())
        return replace(
            self,
            model=tuple(self.model[i] for i in keep),
            measured=tuple(self.measured[i] for i in keep),
            notes=notes,
        )


def match_markers(skeleton: Skeleton, recordings: Sequence[Markers]) -> MarkerMatch:
    """Markers that the model and at least one of the recordings share.

    Names match exactly, else without regard to case and punctuation ("R.ASIS" is "R_Asis").

    Raises:
        FitError: too few are shared; the message names them and the nearest names of the model.
    """
    measured_names = list(dict.fromkeys(name for markers in recordings for name in markers.names))
    exact = set(skeleton.marker_names) & set(measured_names)
    pairs = {name: name for name in skeleton.marker_names if name in exact}
    loose: dict[str, list[str]] = {}
    for name in measured_names:
        if name not in exact:
            loose.setdefault(_plain(name), []).append(name)
    renamed = []
    for name in skeleton.marker_names:
        candidates = loose.get(_plain(name), [])
        if name not in pairs and len(candidates) == 1 and candidates[0] not in pairs.values():
            pairs[name] = candidates[0]
            renamed.append(f"{candidates[0]} = {name}")
    unknown = [name for name in measured_names if name not in pairs.values()]
    notes = []
    if renamed:
        notes.append(f"markers matched by similar names: {', '.join(renamed)}")
    if unknown:
        notes.append(
            f"markers that the model '{skeleton.name}' does not know, left out: {', '.join(unknown)}"
        )
    order = [name for name in skeleton.marker_names if name in pairs]
    match = MarkerMatch(tuple(order), tuple(pairs[name] for name in order), tuple(notes)).seen_in(recordings)
    _require_enough(skeleton, match, unknown)
    return match


def _require_enough(skeleton: Skeleton, match: MarkerMatch, unknown: Sequence[str]) -> None:
    bodies = {skeleton.markers[skeleton.marker_names.index(name)].body for name in match.model}
    if len(match.model) >= FEWEST_SHARED and len(bodies) >= 2:
        return
    hints = []
    for name in unknown[:8]:
        near = get_close_matches(name, skeleton.marker_names, n=1)
        hints.append(f"{name} (nearest: {near[0]})" if near else name)
    known = f": {', '.join(match.model)}" if match.model else ""
    more = " …" if len(unknown) > len(hints) else ""
    raise FitError(
        f"The model '{skeleton.name}' knows only {len(match.model)} of the recording's markers{known}. "
        f"It does not know {', '.join(hints) or 'any other'}{more}. Put the .osim model with this marker set "
        "into the subject folder, or rename the markers."
    )


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())
