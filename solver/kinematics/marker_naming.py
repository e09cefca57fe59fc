"""Recorded labels and the model's markers: who is who, by names, by the atlas, and by a person's word."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from solver.capture.capture import Markers
from solver.common.errors import FitError
from solver.common.notes import Kind, Note, noted
from solver.kinematics.default_body_naming import (
    NamedMarkers,
    landmarks_by_name,
    on_default_body,
    pelvis_notes,
    seen_together,
)
from solver.kinematics.marker_matching import LEFT_OUT, match_markers
from solver.kinematics.own_model_naming import in_own_model, is_bare
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unnamed.settings import NAMING
from solver.markers.atlas import atlas
from solver.markers.label_families import seen_by_video
from solver.markers.label_parts import plain
from solver.markers.understanding import understand
from solver.skeleton.skeleton import Skeleton

CENTRE_M = 0.001  # nearer to the joint, a model's marker stands for its centre


def name_markers(
    generic: Skeleton,
    recordings: Sequence[Markers],
    *,
    default_body: bool,
    chosen: Mapping[str, str] | None = None,
    settings: KinematicsSettings = NAMING,
) -> NamedMarkers:
    """Pair the recordings' labels with the model's markers; the default body gets those it lacks.

    Args:
        generic: unscaled.
        recordings: of one subject.
        default_body: whether `generic` is ours, so that the atlas knows its landmarks; a model of the
            subject's own keeps its markers, and gets others only where these are too few.
        chosen: a person's word: label to landmark or marker of the model, "" to leave the label out.
        settings: of naming.

    Raises:
        FitError: too few markers are shared, or `chosen` names what neither atlas nor model has.
    """
    labels = {name for markers in recordings for name in markers.names}
    word = checked_map(chosen or {}, generic, recordings, default_body=default_body)
    try:
        of_labels = {k: v for k, v in word.items() if k in labels}
        found = _named(generic, recordings, of_labels, default_body, settings)
    except FitError as error:
        gone = sum(target == LEFT_OUT for target in word.values())
        raise FitError(f"{error} The marker map leaves out {gone} labels." if gone else str(error)) from error
    notes = (*found.match.notes, *strangers(word, labels))
    by_video = any(seen_by_video(plain(markers.names).values()) for markers in recordings)
    return replace(found, match=replace(found.match, notes=notes, by_video=by_video))


def with_computed_centres(model: Skeleton, landmarks: Mapping[str, str]) -> Skeleton:
    """A model whose markers at hip centres that a laboratory computed are trusted as far as such centres err.

    Args:
        model: the subject's own.
        landmarks: its marker at each landmark that is known.
    """
    spread = {
        name: mark.spread_m
        for landmark, name in landmarks.items()
        if (mark := atlas()[landmark]).kind == "centre" and landmark.startswith("hip_centre")
    }
    at_joint = {
        m.name
        for m in model.markers
        if np.allclose(m.position_body, model.joints[m.body].p_child_frame, atol=CENTRE_M)
    }
    return model.with_markers(
        [
            replace(m, spread_m=spread[m.name]) if m.name in spread.keys() & at_joint else m
            for m in model.markers
        ]
    )


def strangers(word: Mapping[str, str], labels: Collection[str]) -> tuple[Note, ...]:
    """A note on lines of a map that speak of labels which no recording has."""
    lines = []
    for label in word:
        if label not in labels:
            near = get_close_matches(label, sorted(labels), n=1)
            lines.append(f"{label!r}" + (f" (nearest: {near[0]!r})" if near else ""))
    return (
        noted(Kind.UNUSED_LABELS, f"the marker map names labels that no recording has: {', '.join(lines)}")
        if lines
        else ()
    )


def _named(
    generic: Skeleton,
    recordings: Sequence[Markers],
    word: Mapping[str, str],
    default_body: bool,
    settings: KinematicsSettings,
) -> NamedMarkers:
    if default_body:
        return on_default_body(generic, recordings, word, settings=settings)
    generic, named, notes = in_own_model(generic, recordings, word, settings)
    try:
        match = match_markers(generic, recordings, named=named, notes=notes)
        match = replace(match, notes=(*match.notes, *pelvis_notes(generic, match)))
        landmarks = landmarks_by_name(match)
        return NamedMarkers(with_computed_centres(generic, landmarks), match, landmarks)
    except FitError as error:
        raise FitError(f"{error} Without any model it is fitted on the default body.") from error


def checked_map(
    chosen: Mapping[str, str], generic: Skeleton, recordings: Sequence[Markers], *, default_body: bool
) -> dict[str, str]:
    """A person's word, in which landmarks of a subject's own model are replaced by its markers.

    Args:
        chosen: label to landmark or marker, "" to leave the label out.
        generic: the model.
        recordings: of the subject.
        default_body: whether `generic` is ours.

    Raises:
        FitError: it names what neither atlas nor model has, or gives one bony place to two labels.
    """
    word = {}
    by_landmark = default_body or is_bare(generic)
    of_marker = {} if default_body or not chosen else _markers_by_landmark(generic)
    for label, target in chosen.items():
        if target in ("", *generic.marker_names) or (by_landmark and target in atlas()):
            word[label] = target
        elif target in of_marker:
            word[label] = of_marker[target]
        else:
            raise FitError(_unknown(label, target, generic, by_landmark))
    _require_distinct(word, recordings)
    return word


def _require_distinct(word: Mapping[str, str], recordings: Sequence[Markers]) -> None:
    """One marker of the model, or one bony landmark, is one label on each frame."""
    for label, target in word.items():
        if target == LEFT_OUT or (target in atlas() and atlas()[target].tracks_only):
            continue
        for other, same in word.items():
            if label < other and target == same and seen_together(label, other, recordings):
                raise FitError(
                    f"The marker map gives '{target}' to both {label} and {other}. Leave one of them out: ''."
                )


def _unknown(label: str, target: str, generic: Skeleton, by_landmark: bool) -> str:
    names = [*generic.marker_names, *(atlas() if by_landmark else ())]
    near = get_close_matches(target, names, n=2)
    like = f" Nearest: {', '.join(near)}." if near else ""
    return (
        f"The marker map says {label} = '{target}', neither a landmark nor a marker of '{generic.name}'."
        f"{like} `addb-viewer markers --landmarks` lists the landmarks; '' leaves the label out."
    )


def _markers_by_landmark(generic: Skeleton) -> dict[str, str]:
    rows = understand(generic.marker_names).labels
    return {r.landmark: r.label for r in rows if r.used and r.landmark is not None}
