"""Recorded labels on a model of the subject's own: by its markers' names, by the motion, or by landmarks.

Labels that mean nothing, on a model of the subject's own: found on the default body, carried over.

A model of the subject's own without markers for the recording: landmarks placed on its bodies.

Bodies of the same name are taken for the same segment where their frames agree: in the neutral pose both are
turned alike, and the joint centres that they carry lie alike. Places go over in proportion to the segment.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.errors import FitError
from solver.common.notes import Kind, Note, noted
from solver.kinematics.default_body_naming import on_default_body
from solver.kinematics.label_reading import ReadLabels, read_labels
from solver.kinematics.marker_matching import FEWEST_SHARED, LEFT_OUT, known_by_name, similar_names
from solver.kinematics.scale_prior import stature
from solver.kinematics.settings import KinematicsSettings
from solver.markers.atlas import atlas, place_on
from solver.markers.label_parts import spelling
from solver.markers.understanding import UnderstoodLabel, understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses, carried_joint_centres
from solver.skeleton.skeleton import Marker, Skeleton

ALIKE_M = 0.03  # how far joint centres and markers of two models' bodies may lie apart in the body's frame
CARRIED_STD_M = 0.05  # of a place that was measured on one body and carried over to such another

TURNED_ALIKE = np.radians(20.0)
NEAR_M = 0.05  # a joint centre nearer to the body's origin tells no proportion


def carried_over(
    read: ReadLabels, labels: Iterable[str], default: Skeleton, model: Skeleton
) -> dict[str, Marker]:
    """Markers for labels that the model has none for, on its bodies of the same name.

    Only on bodies whose frames agree: joint centres, and markers that the model calls by a landmark's name,
    lie where those of the default body lie, within ALIKE_M.

    Args:
        read: what was found on the default body.
        labels: those wanted.
        default: the default body.
        model: the subject's own, unscaled.
    """
    ratio = (stature(model) or 0.0) / (stature(default) or 1.0)
    if not ratio:
        return {}
    used = {row.label for row in read.understanding.labels if row.used}
    apart = _apart(default, model, ratio)
    carried = {}
    for label in labels:
        marker = read.found[label]
        body = default.bodies[marker.body].name
        if label in used and apart.get(body, np.inf) < ALIKE_M:
            carried[label] = replace(
                marker,
                body=model.body_index(body),
                position_body=ratio * marker.position_body,
                fixed=False,
                spread_m=max(marker.spread_m or 0.0, CARRIED_STD_M),
            )
    return carried


def _apart(default: Skeleton, model: Skeleton, ratio: float) -> dict[str, float]:
    """By body of both: how far what lies on it lies apart, in the mean [m]."""
    here, there = _points(default, default), _points(model, default)
    apart = {}
    for body in set(default.body_names) & set(model.body_names):
        shared = here[body].keys() & there[body].keys()
        if shared:
            far = [np.linalg.norm(there[body][name] - ratio * here[body][name]) for name in shared]
            apart[body] = float(np.mean(far))
    return apart


def _points(skeleton: Skeleton, default: Skeleton) -> Mapping[str, dict[str, Float[np.ndarray, "3"]]]:
    """Of each body: centres of the joints that it carries, and places of its landmarks, in its frame [m]."""
    points = carried_joint_centres(skeleton, skeleton.default_q)
    if skeleton is default:
        for mark in atlas().values():
            points[mark.body][f"at {mark.name}"] = place_on(mark, default)
        return points
    rows = understand(skeleton.marker_names).by_label()
    for marker in skeleton.markers:
        row = rows[marker.name]
        if row.used and row.landmark is not None and not atlas()[row.landmark].tracks_only:
            points[skeleton.bodies[marker.body].name][f"at {row.landmark}"] = marker.position_body
    return points


def is_bare(model: Skeleton) -> bool:
    """Whether a model came without a marker set."""
    return len(model.markers) < FEWEST_SHARED


def placed_on_model(markers: Sequence[Marker], default: Skeleton, model: Skeleton) -> dict[str, Marker]:
    """Markers of the default body on another model's bodies, by name; those that find none are left out.

    Args:
        markers: on the default body.
        default: the default body, unscaled.
        model: the subject's own, scaled or not.
    """
    ratio = _proportions(default, model)
    return {
        marker.name: replace(
            marker,
            body=model.body_index(default.body_names[marker.body]),
            position_body=ratio[default.body_names[marker.body]] * marker.position_body,
        )
        for marker in markers
        if default.body_names[marker.body] in ratio
    }


def _proportions(default: Skeleton, model: Skeleton) -> dict[str, float]:
    """Size of each segment of the model, with that of the default body as one, where frames agree.

    Joints that lie otherwise are set aside as long as others agree. A segment that shares no joint with the
    other body's (a hand) has the size of the one that it hangs on. Nothing where the root's frames differ.
    """
    carried_here, carried_there = (carried_joint_centres(s, np.zeros(len(s.dofs))) for s in (default, model))
    R_here, R_there = _neutral(default), _neutral(model)
    ratio: dict[str, float] = {}
    for b, name in enumerate(default.body_names):
        if name not in model.body_names:
            continue
        if _angle(R_here[b].T @ R_there[model.body_index(name)]) > TURNED_ALIKE:
            continue
        ours, theirs = carried_here[name], carried_there[name]
        shared = [child for child in ours if child in theirs and np.linalg.norm(ours[child]) > NEAR_M]
        parent = default.joints[b].parent
        if not shared:
            inherited = ratio.get(default.body_names[parent]) if parent >= 0 else None
            if inherited is not None:
                ratio[name] = inherited
            continue
        one = np.array([ours[child] for child in shared])
        other = np.array([theirs[child] for child in shared])
        size = _size(one, other)
        if size is not None:
            ratio[name] = size
    return ratio if default.body_names[0] in ratio else {}


def _size(one: Float[np.ndarray, "joints 3"], other: Float[np.ndarray, "joints 3"]) -> float | None:
    """Ratio of two sets of joint centres, the worst set aside until the rest agree; None where none do."""
    while len(one):
        size = float(np.linalg.norm(other) / np.linalg.norm(one))
        apart = np.linalg.norm(other - size * one, axis=1)
        if apart.mean() < ALIKE_M:
            return size
        keep = np.arange(len(one)) != np.argmax(apart)
        one, other = one[keep], other[keep]
    return None


def _neutral(skeleton: Skeleton) -> Float[np.ndarray, "bodies 3 3"]:
    """Orientations of the bodies with all coordinates at zero; ground frame."""
    return body_poses(skeleton, np.zeros((1, len(skeleton.dofs))))[0][0]


def _angle(R: Float[np.ndarray, "3 3"]) -> float:
    """By which a rotation turns [rad]."""
    return float(np.arccos(np.clip((np.trace(R) - 1) / 2, -1.0, 1.0)))


def own_names(model: Skeleton, recordings: Sequence[Markers]) -> dict[str, str]:
    """The marker of a subject's own model for each label that it knows by name, in whatever spelling.

    Args:
        model: the subject's own.
        recordings: of one subject.
    """
    return known_by_name(model, recordings) | _other_names(model, recordings, {})


def in_own_model(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str], settings: KinematicsSettings
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
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str], settings: KinematicsSettings
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
    settings: KinematicsSettings,
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
