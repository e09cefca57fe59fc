"""Recorded labels and the model's markers: who is who, by names, by the atlas, and by a person's word."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from solver.capture.capture import Markers
from solver.errors import FitError
from solver.kinematics.flat_foot import on_flat_feet
from solver.kinematics.label_reading import read_labels
from solver.kinematics.marker_matching import (
    FEWEST_SHARED,
    LEFT_OUT,
    MarkerMatch,
    match_markers,
    similar_names,
)
from solver.kinematics.nonsense_on_own_model import carried_over
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.upright_pelvis import on_upright_pelvis
from solver.markers.atlas import atlas, landmark_marker
from solver.markers.label_parts import spelling
from solver.markers.understanding import UnderstoodLabel, understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Marker, Skeleton


@dataclass(frozen=True)
class NamedMarkers:
    """The model with a marker for every label that is understood, and which label is which marker."""

    skeleton: Skeleton
    match: MarkerMatch


def name_markers(
    generic: Skeleton,
    recordings: Sequence[Markers],
    *,
    default_body: bool,
    chosen: Mapping[str, str] | None = None,
) -> NamedMarkers:
    """Pair the recordings' labels with the model's markers; the default body gets those it lacks.

    Args:
        generic: unscaled.
        recordings: of one subject.
        default_body: whether `generic` is ours, so that the atlas knows its landmarks; a model of the
            subject's own keeps its markers, and only other spellings of their names are understood.
        chosen: a person's word: label to landmark or marker of the model, "" to leave the label out.

    Raises:
        FitError: too few markers are shared, or `chosen` names what neither atlas nor model has.
    """
    word = _checked(chosen or {}, generic, default_body)
    if not default_body:
        generic, named, notes = _in_own_model(generic, recordings, word)
        return NamedMarkers(generic, match_markers(generic, recordings, named=named, notes=notes))
    skeleton, named, notes = _on_default_body(generic, recordings, word)
    match = match_markers(skeleton, recordings, named=named, notes=notes)
    skeleton = on_flat_feet(skeleton, match, recordings, KinematicsSettings())
    return NamedMarkers(on_upright_pelvis(skeleton, match, recordings), match)


def own_names(model: Skeleton, recordings: Sequence[Markers]) -> dict[str, str]:
    """The marker of a subject's own model for each label that it knows by name, in whatever spelling.

    Args:
        model: the subject's own.
        recordings: of one subject.
    """
    known = {m: name for r in recordings for name, m in similar_names(model.marker_names, r.names).items()}
    return known | _other_names(model, recordings, {})


def _on_default_body(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str]
) -> tuple[Skeleton, dict[str, str], tuple[str, ...]]:
    read = read_labels(generic, recordings)
    by_itself = {r.label: r.landmark if r.used else LEFT_OUT for r in read.understanding.labels}
    word = {label: target for label, target in word.items() if target != by_itself.get(label)}
    if word and read.found:
        read = read_labels(generic, recordings, word)
    rows = read.understanding.labels
    known = {
        m: model for r in recordings for model, m in similar_names(generic.marker_names, r.names).items()
    }
    own = {marker.name: marker for marker in generic.markers}
    new: dict[str, Marker] = {}
    named: dict[str, str] = {}
    for row in sorted(rows, key=lambda r: (r.same_as is not None, -r.confidence)):
        target = word.get(row.label)
        if target is None and row.label in read.found:
            named[row.label] = row.label if row.used else LEFT_OUT
            if row.used:
                new[row.label] = read.found[row.label]
            continue
        if target is None and row.landmark is None:
            continue  # nothing but the body's own names can know it
        if target is None and row.same_as is not None and not _together(row.label, row.same_as, recordings):
            named[row.label] = named.get(row.same_as, LEFT_OUT)
            continue
        if target is not None and target in own:
            named[row.label] = target
            continue
        wanted = row.landmark if target is None and row.used else target
        landmark = atlas().get(wanted or LEFT_OUT)
        if landmark is None:
            named[row.label] = LEFT_OUT
            continue
        place = landmark_marker(landmark, row.label, generic)
        if target is None:
            place = replace(place, spread_m=row.spread_m)
        usual = own.get(known.get(row.label, ""))
        if (
            target is None
            and usual is not None
            and usual.body == place.body
            and (
                landmark.tracks_only
                or (row.certain and np.array_equal(usual.position_body, place.position_body))
            )
        ):
            named[row.label] = usual.name
            continue
        twin = _same_marker(row.label, named, recordings) if landmark.tracks_only else None
        if twin is None:
            new[row.label] = place
        named[row.label] = twin or row.label
    kept = [marker for marker in generic.markers if marker.name not in new]
    return (
        generic.with_markers([*kept, *new.values()]),
        named,
        (
            *read.notes,
            *_notes([r for r in rows if r.label not in read.found], named, word, set(new)),
        ),
    )


def _in_own_model(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str]
) -> tuple[Skeleton, dict[str, str], tuple[str, ...]]:
    """Labels that the model knows by name; where these are too few, by the motion."""
    _require_distinct(word, recordings)
    known = {m for r in recordings for m in similar_names(generic.marker_names, r.names).values()}
    named = _other_names(generic, recordings, word)
    found = {label: name for label, name in named.items() if label not in word}
    notes = (f"markers that the model has under other names: {_listed(found)}",) if found else ()
    if len(known) + sum(name != LEFT_OUT for name in named.values()) < FEWEST_SHARED:
        by_motion = _by_the_motion(generic, recordings, word)
        if by_motion is not None:
            return by_motion
    return generic, named, notes


def _other_names(generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str]) -> dict[str, str]:
    """Besides a person's word, labels that the model has in another spelling, or as the same landmark."""
    labels = _labels(recordings)
    known = {m for r in recordings for m in similar_names(generic.marker_names, r.names).values()}
    taken = {model for r in recordings for model in similar_names(generic.marker_names, r.names)}
    named = dict(word)
    free = [label for label in labels if label not in known and label not in named]
    markers = [name for name in generic.marker_names if name not in taken and name not in word.values()]
    for label, name in _only_pairs(free, markers, spelling, spelling):
        named[label] = name
    free = [label for label in free if label not in named]
    markers = [name for name in markers if name not in named.values()]
    if free and markers:
        of_label = {r.label: r for r in understand(labels, recordings).labels}
        of_marker = understand(generic.marker_names).by_label()
        taken_places = {of_marker[name].landmark for name in generic.marker_names if name not in markers}
        for label, name in _only_pairs(
            free,
            markers,
            lambda label: _landmark(of_label[label]) - taken_places,
            lambda name: _landmark(of_marker[name]),
        ):
            named[label] = name
    return named


def _by_the_motion(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str]
) -> tuple[Skeleton, dict[str, str], tuple[str, ...]] | None:
    """Labels that mean nothing: found on the default body, and paired with the model's markers by landmark.

    The model's bodies get markers for others that move with them, where they are like the default body's.
    None where too few are found.
    """
    default = default_skeleton()
    read = read_labels(default, recordings)
    places = {
        row.label: _landmark(row)
        for row in read.understanding.labels
        if row.label in read.found and row.label not in word
    }
    of_marker = understand(generic.marker_names).by_label()
    markers = {n: _landmark(of_marker[n]) for n in generic.marker_names if n not in word.values()}
    pairs = dict(_only_pairs(list(places), list(markers), places.__getitem__, markers.__getitem__))
    if len(pairs) < FEWEST_SHARED:
        return None
    new = carried_over(read, [label for label in places if label not in pairs], default, generic)
    lost = [label for label in places if label not in pairs and label not in new]
    notes = [f"labels without a meaning, found by the motion: {_listed(pairs)}"]
    if new:
        on = {label: generic.bodies[marker.body].name for label, marker in new.items()}
        notes.append(f"labels without a meaning, attached to the bodies that they move with: {_listed(on)}")
    if lost:
        notes.append(f"labels without a meaning, of no marker of the model, left out: {', '.join(lost)}")
    kept = [marker for marker in generic.markers if marker.name not in new]
    named = {**dict.fromkeys(lost, LEFT_OUT), **pairs, **{label: label for label in new}, **word}
    return generic.with_markers([*kept, *new.values()]), named, tuple(notes)


def _listed(pairs: Mapping[str, str]) -> str:
    return ", ".join(f"{label} = {name}" for label, name in pairs.items())


def _require_distinct(word: Mapping[str, str], recordings: Sequence[Markers]) -> None:
    for label, target in word.items():
        for other, same in word.items():
            if label < other and target == same != LEFT_OUT and _together(label, other, recordings):
                raise FitError(
                    f"The marker map gives the model's marker '{target}' to both {label} and {other}. "
                    "Leave one of them out: ''."
                )


def _landmark(row: UnderstoodLabel) -> frozenset[str | None]:
    """The landmark of a label, where that is a single place on the body."""
    certain = row.used and row.landmark is not None and not atlas()[row.landmark].tracks_only
    return frozenset((row.landmark,)) if certain else frozenset()


def _only_pairs(
    labels: Sequence[str],
    markers: Sequence[str],
    of_label: Callable[[str], frozenset],
    of_marker: Callable[[str], frozenset],
) -> Iterator[tuple[str, str]]:
    """Pairs that share something that no other label and no other marker has."""
    keys_l = {label: of_label(label) for label in labels}
    keys_m = {name: of_marker(name) for name in markers}
    for label, keys in keys_l.items():
        partners = [name for name, other in keys_m.items() if keys & other]
        if len(partners) == 1 and sum(bool(k & keys_m[partners[0]]) for k in keys_l.values()) == 1:
            yield label, partners[0]


def _same_marker(label: str, named: Mapping[str, str], recordings: Sequence[Markers]) -> str | None:
    """The model's marker of another recording's spelling of the label."""
    own = spelling(label)
    for other, marker in named.items():
        if marker and spelling(other) & own and not _together(label, other, recordings):
            return marker
    return None


def _together(one: str, other: str, recordings: Sequence[Markers]) -> bool:
    return any(one in r.names and other in r.names for r in recordings)


def _labels(recordings: Sequence[Markers]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for markers in recordings for name in markers.names))


def _checked(chosen: Mapping[str, str], generic: Skeleton, default_body: bool) -> dict[str, str]:
    """A person's word, in which landmarks of a subject's own model are replaced by its markers."""
    word = {}
    of_marker = {} if default_body else _markers_by_landmark(generic)
    for label, target in chosen.items():
        if target in ("", *generic.marker_names) or (default_body and target in atlas()):
            word[label] = target
        elif target in of_marker:
            word[label] = of_marker[target]
        else:
            raise FitError(_unknown(label, target, generic, default_body))
    return word


def _unknown(label: str, target: str, generic: Skeleton, default_body: bool) -> str:
    names = [*generic.marker_names, *(atlas() if default_body else ())]
    near = get_close_matches(target, names, n=2)
    like = f" Nearest: {', '.join(near)}." if near else ""
    return (
        f"The marker map says {label} = '{target}', neither a landmark nor a marker of '{generic.name}'."
        f"{like} `addb-viewer markers --landmarks` lists the landmarks; '' leaves the label out."
    )


def _markers_by_landmark(generic: Skeleton) -> dict[str, str]:
    rows = understand(generic.marker_names).labels
    return {r.landmark: r.label for r in rows if r.used and r.landmark is not None}


def _notes(
    rows: Sequence[UnderstoodLabel], named: Mapping[str, str], word: Mapping[str, str], new: set[str]
) -> tuple[str, ...]:
    notes = []
    atlas_named = [f"{r.label} = {r.landmark}" for r in rows if r.label in new and r.label not in word]
    if atlas_named:
        notes.append(f"labels understood by the atlas: {', '.join(atlas_named)}")
    if word:
        notes.append(f"labels that the marker map explains: {', '.join(word)}")
    doubtful = [
        f"{r.label} ({r.landmark}, {r.confidence:.2f})"
        for r in rows
        if r.label not in word and r.landmark is not None and not r.used and not named.get(r.label)
    ]
    if doubtful:
        notes.append(
            f"labels not understood with enough confidence, or of a place that another label has: "
            f"{', '.join(doubtful)}; `addb-viewer markers` lists the alternatives"
        )
    return tuple(notes)
