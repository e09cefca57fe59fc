"""Which measured markers the model knows, by name."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.errors import FitError
from solver.common.notes import Kind, Note, noted
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.skeleton import Skeleton

FEWEST_SHARED = 6  # below it a pose is not determined in any useful sense
LEFT_OUT = ""  # in place of a marker's name: the label is not to be used


@dataclass(frozen=True)
class MarkerMatch:
    """Shared markers: `measured[i]` lists what the recordings call the model's marker `model[i]`.

    Recordings of one subject may spell a marker differently: the static trial "R.ASIS", a walk "r_asis".
    """

    model: tuple[str, ...]
    measured: tuple[tuple[str, ...], ...]
    notes: tuple[Note, ...]
    by_video: bool = False  # whether a markerless system saw them: errors wander, where skin follows joints

    def observed(self, markers: Markers) -> Float[np.ndarray, "frames markers 3"]:
        """The recording's positions of the shared markers [m]; NaN for those this trial lacks."""
        observed = np.full((markers.frames, len(self.model), 3), np.nan)
        for i, column in enumerate(self.columns(markers)):
            if column is not None:
                observed[:, i] = markers.positions_ground[:, column]
        return observed

    def columns(self, markers: Markers) -> tuple[int | None, ...]:
        """Where a recording has each shared marker; None for those that it lacks."""
        column = {name: i for i, name in enumerate(markers.names)}
        known = (next((n for n in spellings if n in column), None) for spellings in self.measured)
        return tuple(None if name is None else column[name] for name in known)

    def skeleton(self, skeleton: Skeleton) -> Skeleton:
        """The skeleton with just the shared markers, in their order."""
        by_name = {m.name: m for m in skeleton.markers}
        return skeleton.with_markers([by_name[name] for name in self.model])

    def seen_in(self, recordings: Sequence[Markers]) -> "MarkerMatch":
        """Without markers that none of these recordings ever saw."""
        seen = np.zeros(len(self.model), dtype=bool)
        for markers in recordings:
            seen |= np.isfinite(self.observed(markers)).all(axis=2).any(axis=0)
        lost = [self.measured[i][0] for i in np.flatnonzero(~seen)]
        if not lost:
            return self
        why = Note(Kind.LEFT_OUT, f"never seen in any frame, so left out: {', '.join(lost)}")
        return self.without([self.model[i] for i in np.flatnonzero(~seen)], why)

    def without(self, names: Sequence[str], why: Note) -> "MarkerMatch":
        """Without these markers of the model."""
        pairs = zip(self.model, self.measured, strict=True)
        kept = {name: labels for name, labels in pairs if name not in names}
        return replace(self, model=tuple(kept), measured=tuple(kept.values()), notes=(*self.notes, why))


def match_markers(
    skeleton: Skeleton,
    recordings: Sequence[Markers],
    *,
    named: Mapping[str, str] | None = None,
    notes: Sequence[Note] = (),
) -> MarkerMatch:
    """Markers that the model and at least one of the recordings share; each recording by its own names.

    Args:
        skeleton: with the model's markers.
        recordings: of one subject.
        named: by label, the marker that it is known to be, or `LEFT_OUT`; names decide the rest.
        notes: how that is known.

    Raises:
        FitError: too few are shared; the message names them and the nearest names of the model.
    """
    spellings: dict[str, list[str]] = {}
    for markers in recordings:
        for model, measured in _pairs(skeleton.marker_names, markers.names, named or {}).items():
            if measured not in spellings.setdefault(model, []):
                spellings[model].append(measured)
    for model, names in spellings.items():
        names.sort(key=model.__ne__)  # the exact name first
    used = {name for names in spellings.values() for name in names}
    unknown = [name for name in dict.fromkeys(n for m in recordings for n in m.names) if name not in used]
    order = [name for name in skeleton.marker_names if name in spellings]
    renamed = [f"{name} = {model}" for model in order for name in spellings[model] if name != model]
    said = list(notes)
    if renamed:
        said += noted(Kind.LABELS, f"markers matched by similar names: {some_of(renamed)}")
    untold = [name for name in unknown if (named or {}).get(name) != LEFT_OUT]
    if untold:
        said += noted(
            Kind.LABELS,
            f"markers that the model '{skeleton.name}' does not know, left out: {some_of(untold)}",
        )
    match = MarkerMatch(tuple(order), tuple(tuple(spellings[name]) for name in order), tuple(said))
    match = match.seen_in(recordings)
    _require_enough(skeleton, match, unknown)
    return replace(match, notes=(*match.notes, *_bare_body_notes(skeleton, match)))


def _bare_body_notes(skeleton: Skeleton, match: MarkerMatch) -> tuple[Note, ...]:
    """Segments that no marker of the recordings tells, and others on which the model alone has markers."""
    untold = {d for d, u in zip(skeleton.dofs, undetermined_dofs(match.skeleton(skeleton)), strict=True) if u}
    shared = {marker.body for marker in skeleton.markers if marker.name in match.model}
    free = [
        body
        for body, joint in enumerate(skeleton.joints)
        if body not in shared and any(a.coordinate in untold for a in joint.axes)
    ]
    bare = sorted({marker.body for marker in skeleton.markers} - shared - set(free))
    notes: list[Note] = []
    if free:
        notes += noted(
            Kind.BARE_BODIES,
            f"no marker of the recordings shows the motion of {_listed(skeleton, free)}; they are kept near "
            "the neutral pose, and have no angles",
        )
    if bare:
        notes += noted(
            Kind.BARE_BODIES,
            f"no marker of the recordings is on {_listed(skeleton, bare)}: how they move is a guess",
        )
    return tuple(notes)


def _listed(skeleton: Skeleton, bodies: Sequence[int]) -> str:
    return ", ".join(skeleton.bodies[body].name for body in bodies)


def _pairs(
    model_names: Sequence[str], measured_names: Sequence[str], named: Mapping[str, str]
) -> dict[str, str]:
    """Model name to measured name: first what is known, then by similar names."""
    known = {named[name]: name for name in measured_names if named.get(name, LEFT_OUT) != LEFT_OUT}
    rest = similar_names(
        [name for name in model_names if name not in known], [n for n in measured_names if n not in named]
    )
    return known | rest


def known_by_name(skeleton: Skeleton, recordings: Sequence[Markers]) -> dict[str, str]:
    """The model's marker for each label of the recordings that has a similar name."""
    return {
        label: name
        for r in recordings
        for name, label in similar_names(skeleton.marker_names, r.names).items()
    }


def similar_names(model_names: Sequence[str], measured_names: Sequence[str]) -> dict[str, str]:
    """Model name to measured name, looser from round to round, and only where neither has a rival.

    Names match exactly, else but for case, punctuation ("R.ASIS" is "R_Asis") and the subject's name before a
    colon; the nearest way of writing wins, and where two markers remain for one name none is guessed.
    """
    pairs: dict[str, str] = {}
    for key in (str, str.casefold, _one_separator, _plain):
        free_model = _by_key([name for name in model_names if name not in pairs], key)
        free_measured = _by_key([name for name in measured_names if name not in pairs.values()], key)
        for name, candidates in free_measured.items():
            owners = free_model.get(name, [])
            if len(owners) == len(candidates) == 1:
                pairs[owners[0]] = candidates[0]
    return pairs


def _by_key(names: Sequence[str], key: Callable[[str], str]) -> dict[str, list[str]]:
    grouped: dict[str, list[str]] = {}
    for name in names:
        grouped.setdefault(key(name), []).append(name)
    return grouped


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


def _one_separator(name: str) -> str:
    """Without the subject's name before a colon; one sign for every punctuation."""
    return re.sub(r"[^a-z0-9]+", "_", name.rpartition(":")[2].lower())


def _plain(name: str) -> str:
    return _one_separator(name).replace("_", "")
