"""Recorded labels on a model of the subject's own: by its markers' names, by the motion, or by landmarks."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.errors import FitError
from solver.common.notes import Kind, Note, noted
from solver.kinematics.bare_model import is_bare, placed_on_model
from solver.kinematics.default_body_naming import on_default_body
from solver.kinematics.label_reading import read_labels
from solver.kinematics.marker_matching import FEWEST_SHARED, LEFT_OUT, known_by_name, similar_names
from solver.kinematics.nonsense_on_own_model import carried_over
from solver.kinematics.unnamed.settings import NamingSettings
from solver.markers.atlas import atlas
from solver.markers.label_parts import spelling
from solver.markers.understanding import UnderstoodLabel, understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Skeleton


def own_names(model: Skeleton, recordings: Sequence[Markers]) -> dict[str, str]:
    """The marker of a subject's own model for each label that it knows by name, in whatever spelling.

    Args:
        model: the subject's own.
        recordings: of one subject.
    """
    return known_by_name(model, recordings) | _other_names(model, recordings, {})


def in_own_model(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str], settings: NamingSettings
) -> tuple[Skeleton, dict[str, str], tuple[Note, ...]]:
    """Labels that the model knows by name; where these are too few, by the motion or by landmarks.

    Args:
        generic: the subject's own model, unscaled.
        recordings: of one subject.
        word: a person's: label to marker of the model, "" to leave the label out.
        settings: of naming.

    Returns:
        The model with markers added for labels it had none for; label to marker; how that is known.
    """
    own = set(generic.marker_names)
    named = _other_names(generic, recordings, word)
    found = {label: name for label, name in named.items() if label not in word}
    notes = (
        noted(Kind.LABELS, f"markers that the model has under other names: {_listed(found)}") if found else ()
    )
    known = known_by_name(generic, recordings) | named
    paired = {label: name for label, name in known.items() if name in own}
    if len(paired) < FEWEST_SHARED:
        by_motion = None if is_bare(generic) else _by_the_motion(generic, recordings, word, settings)
        elsewhere = by_motion or _by_landmarks(generic, recordings, word, paired, settings)
        if elsewhere is not None:
            return elsewhere
    return generic, {label: name for label, name in named.items() if name in (LEFT_OUT, *own)}, notes


def _other_names(generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str]) -> dict[str, str]:
    """Besides a person's word, labels that the model has in another spelling, or as the same landmark."""
    labels = _labels(recordings)
    known = known_by_name(generic, recordings)
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
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str], settings: NamingSettings
) -> tuple[Skeleton, dict[str, str], tuple[Note, ...]] | None:
    """Labels that mean nothing: found on the default body, and paired with the model's markers by landmark.

    The model's bodies get markers for others that move with them, where they are like the default body's.
    None where too few are found.
    """
    default = default_skeleton()
    read = read_labels(default, recordings, settings=settings)
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
    notes = [Note(Kind.LABELS, f"labels without a meaning, found by the motion: {_listed(pairs)}")]
    if new:
        on = {label: generic.bodies[marker.body].name for label, marker in new.items()}
        notes += noted(
            Kind.LABELS,
            f"labels without a meaning, attached to the bodies that they move with: {_listed(on)}",
        )
    if lost:
        notes += noted(
            Kind.UNUSED_LABELS,
            f"labels without a meaning that match no marker of the model, left out: {some_of(lost)}",
        )
    kept = [marker for marker in generic.markers if marker.name not in new]
    named = {**dict.fromkeys(lost, LEFT_OUT), **pairs, **{label: label for label in new}, **word}
    return generic.with_markers([*kept, *new.values()]), named, tuple(notes)


def _by_landmarks(
    generic: Skeleton,
    recordings: Sequence[Markers],
    word: Mapping[str, str],
    paired: Mapping[str, str],
    settings: NamingSettings,
) -> tuple[Skeleton, dict[str, str], tuple[Note, ...]] | None:
    """A model without markers for the labels gets them where the default body has them, as it would be read.

    Labels that are paired with markers of its own keep these. None where the labels say too little, or its
    bodies are not like the default body's.
    """
    default = default_skeleton()
    of_its_own = {label: LEFT_OUT for label, target in word.items() if label in paired}
    try:
        read = on_default_body(default, recordings, {**word, **of_its_own}, settings=settings)
    except FitError:
        return None
    wanted = [
        replace(marker, name=labels[0])
        for marker, labels in zip(
            read.match.skeleton(read.skeleton).markers, read.match.measured, strict=True
        )
        if not paired.keys() & set(labels)
    ]
    placed = placed_on_model(wanted, default, generic)
    if len(placed) + len(paired) < FEWEST_SHARED:
        return None
    named = {
        label: labels[0] if labels[0] in placed else LEFT_OUT
        for labels in read.match.measured
        for label in labels
        if label not in paired
    }
    lost = [label for label, marker in named.items() if not marker]
    on = {label: generic.bodies[placed[m].body].name for label, m in named.items() if m}
    notes = [
        Note(
            Kind.LABELS,
            f"labels that the model has no markers for, put where the atlas has them: {_listed(on)}",
        )
    ]
    if lost:
        notes += noted(
            Kind.OTHER,
            f"labels on segments that the model lacks or defines differently, left out: {some_of(lost)}",
        )
    kept = [marker for marker in generic.markers if marker.name not in placed]
    unused = dict.fromkeys((label for label in _labels(recordings) if label not in named), LEFT_OUT)
    return generic.with_markers([*kept, *placed.values()]), {**unused, **named, **paired}, tuple(notes)


def _listed(pairs: Mapping[str, str]) -> str:
    return some_of([f"{label} = {name}" for label, name in pairs.items()])


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


def _labels(recordings: Sequence[Markers]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for markers in recordings for name in markers.names))
