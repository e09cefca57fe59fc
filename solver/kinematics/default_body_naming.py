"""Recorded labels on the default body: its own markers, and one at its landmark for each label it lacks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.notes import Kind, Note, noted
from solver.kinematics.flat_foot import on_flat_feet
from solver.kinematics.hip_width import LEG_LANDMARKS
from solver.kinematics.label_reading import read_labels
from solver.kinematics.marker_matching import LEFT_OUT, MarkerMatch, known_by_name, match_markers
from solver.kinematics.pelvis_markers import SPINES, pelvis_notes
from solver.kinematics.unnamed.settings import NAMING, NamingSettings
from solver.kinematics.upright_pelvis import at_landmarks, on_upright_pelvis
from solver.markers.atlas import atlas, landmark_marker
from solver.markers.label_parts import spelling
from solver.markers.understanding import UnderstoodLabel
from solver.skeleton.skeleton import Marker, Skeleton


@dataclass(frozen=True)
class NamedMarkers:
    """The model with a marker for every label that is understood, and which label is which marker."""

    skeleton: Skeleton
    match: MarkerMatch
    landmarks: Mapping[str, str] = field(default_factory=dict)  # marker of the model at each that is known


def on_default_body(
    generic: Skeleton,
    recordings: Sequence[Markers],
    word: Mapping[str, str],
    *,
    settings: NamingSettings = NAMING,
) -> NamedMarkers:
    """The default body with a marker for every label that is understood.

    Args:
        generic: the default body, unscaled.
        recordings: of one subject.
        word: a person's: label to landmark or marker of the body, "" to leave the label out.
        settings: of naming.

    Raises:
        FitError: too few labels are understood.
    """
    skeleton, named, notes = _named(generic, recordings, word, settings)
    match = match_markers(skeleton, recordings, named=named, notes=notes)
    landmarks = at_landmarks(skeleton, match, (*SPINES, "sacrum", *LEG_LANDMARKS))
    match = replace(match, notes=(*match.notes, *pelvis_notes(skeleton, match, landmarks)))
    skeleton = on_flat_feet(skeleton, match, recordings, settings.kinematics)
    return NamedMarkers(on_upright_pelvis(skeleton, match, recordings), match, landmarks)


def _named(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str], settings: NamingSettings
) -> tuple[Skeleton, dict[str, str], tuple[Note, ...]]:
    read = read_labels(generic, recordings, settings=settings)
    by_itself = {r.label: r.landmark if r.used else LEFT_OUT for r in read.understanding.labels}
    word = {label: target for label, target in word.items() if target != by_itself.get(label)}
    if word and read.found:
        read = read_labels(generic, recordings, word, settings=settings)
    rows = read.understanding.labels
    known = known_by_name(generic, recordings)
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
        if target is None and row.computed:
            named[row.label] = LEFT_OUT
            continue
        if target is None and row.landmark is None:
            continue  # nothing but the body's own names can know it
        if (
            target is None
            and row.same_as is not None
            and not seen_together(row.label, row.same_as, recordings)
        ):
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
        counterpart = _same_marker(row.label, named, recordings) if landmark.tracks_only else None
        if counterpart is None:
            new[row.label] = place
        named[row.label] = counterpart or row.label
    kept = [marker for marker in generic.markers if marker.name not in new]
    return (
        generic.with_markers([*kept, *new.values()]),
        named,
        (
            *read.notes,
            *_notes([r for r in rows if r.label not in read.found], named, word, set(new)),
        ),
    )


def _same_marker(label: str, named: Mapping[str, str], recordings: Sequence[Markers]) -> str | None:
    """The model's marker of another recording's spelling of the label."""
    own = spelling(label)
    for other, marker in named.items():
        if marker and spelling(other) & own and not seen_together(label, other, recordings):
            return marker
    return None


def seen_together(one: str, other: str, recordings: Sequence[Markers]) -> bool:
    """Whether some recording has both labels."""
    return any(one in r.names and other in r.names for r in recordings)


def _notes(
    rows: Sequence[UnderstoodLabel], named: Mapping[str, str], word: Mapping[str, str], new: set[str]
) -> tuple[Note, ...]:
    notes: list[Note] = []
    atlas_named = [r.label for r in rows if r.label in new and r.label not in word]
    if atlas_named:
        notes += noted(
            Kind.LABELS,
            f"labels understood by the atlas: {some_of(atlas_named)} (`addb-viewer markers` says how)",
        )
    if word:
        notes += noted(Kind.LABELS, f"labels that the marker map explains: {some_of(list(word))}")
    doubtful = [
        f"{r.label} ({r.landmark}, {r.confidence:.2f})"
        for r in rows
        if r.label not in word and r.landmark is not None and not r.used and not named.get(r.label)
    ]
    if doubtful:
        notes += noted(
            Kind.UNUSED_LABELS,
            f"labels not understood with enough confidence, or of a place that another label has: "
            f"{some_of(doubtful)}; `addb-viewer markers` lists the alternatives",
        )
    return tuple(notes)
