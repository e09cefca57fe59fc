"""What labels mean on the default body: by their names, and where these say nothing, by the motion."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.capture.marker_cleaning import RIGID_M, SEGMENT_REACH_M
from solver.common.errors import FitError
from solver.common.notes import Kind, Note, noted
from solver.kinematics.marker_matching import FEWEST_SHARED, LEFT_OUT, known_by_name
from solver.kinematics.scale_prior import stature
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unnamed.landmark_mixture import landmark_mixture
from solver.kinematics.unnamed.recognition import FoundMarker, recognise
from solver.kinematics.unnamed.settings import FEWEST_MARKERS, NAMING
from solver.markers.atlas import atlas, place_on
from solver.markers.understanding import SURE_ENOUGH, Understanding, UnderstoodLabel, understand
from solver.skeleton.skeleton import Marker, Skeleton

# of the labels that some table has; if fewer keep their distances, the names are wrong
NAMES_HOLD_SHARE = 0.5
LEG = ("femur", "tibia", "patella", "talus", "calcn", "toes")
FEWEST_OF_A_LEG = 3  # labels without a meaning, if no label tells of a leg: thigh, shank and foot
# labels without a name, of those with one: then the named ones tell the pose of every limb
FEW_UNNAMED_SHARE = 0.25
_REGION = {  # the landmark that stands for "somewhere on this segment"
    "pelvis": "pelvis_cluster",
    "femur": "thigh_cluster",
    "tibia": "shank_cluster",
    "patella": "patella",
    "talus": "ankle_centre",
    "calcn": "foot_cluster",
    "toes": "hallux",
    "torso": "trunk_cluster",
    "humerus": "upper_arm",
    "ulna": "forearm",
    "radius": "wrist_middle",
    "hand": "hand_cluster",
}
FRAMES = 60  # of each recording
SAME_M = 0.025  # skin and posture move distances within a segment by less
FRAME_REACH_M = 0.15  # of a marker on a frame or plate from where its name says
FEWEST_PAIRS = 10  # rigid in both recordings; fewer tell nothing
LEAST_AGREEING_SHARE = 0.6  # of them, at least


@dataclass(frozen=True)
class ReadLabels:
    """Every label's row, and the places of those that were found by the motion."""

    understanding: Understanding
    found: dict[str, Marker]  # on the default body
    notes: tuple[Note, ...] = ()


def read_labels(
    body: Skeleton,
    recordings: Sequence[Markers],
    known: Mapping[str, str] | None = None,
    *,
    settings: KinematicsSettings = NAMING,
) -> ReadLabels:
    """Read all labels of a subject's recordings.

    Where most names hold, only labels that no table has are looked for on the body. Where they don't, because
    they mean nothing or stand on the wrong trajectories, all markers are.

    Args:
        body: the default body, unscaled, with its own markers.
        recordings: of one subject.
        known: a person's word: label to landmark or marker of the body, "" to leave it out.
        settings: of the search for labels that no table has.

    Raises:
        FitError: the labels mean nothing, and not the same in all recordings.
    """
    labels = list(dict.fromkeys(name for markers in recordings for name in markers.names))
    understood = understand(labels, recordings)
    of_word = {label: _landmark_of(target, body) for label, target in (known or {}).items()}
    own = {label: _landmark_of(name, body) for label, name in known_by_name(body, recordings).items()}
    meant = [row for row in understood.labels if row.landmark is not None]
    used = {row.label: row.landmark for row in meant if row.used and row.landmark is not None}
    pinned = {
        label: name
        for label, name in (own | used).items()
        if label not in {r.label for r in meant if not r.used}
    }
    holds = len(pinned) >= FEWEST_SHARED and len(used) >= NAMES_HOLD_SHARE * len(meant)
    computed = [row.label for row in understood.labels if row.computed]
    unknown = {r.label for r in understood.labels} - {*pinned, *computed, *(r.label for r in meant)}
    untold = sorted(unknown) if holds and len(computed) > len(unknown) else []
    notes = _computed_notes(computed, untold)
    elsewhere = _elsewhere_on_their_body(meant) if holds else {}
    unknown = (unknown - set(untold)) | elsewhere.keys()
    if holds and not unknown:
        return ReadLabels(understood, {}, notes)
    pinned = {**(pinned if holds else {}), **{label: name for label, name in of_word.items() if name}}
    wanted = [label for label in labels if of_word.get(label) != LEFT_OUT and label not in computed]
    looked_at = _only(recordings, wanted)
    if not holds:
        unlike = disagreeing(looked_at)
        if unlike is not None:
            raise FitError(
                f"The labels have no meaning, and differ between recordings: {unlike}. "
                "Fit the trials one at a time, without a static trial, or name the labels in a marker map."
            )
        if len(wanted) < FEWEST_MARKERS:
            return ReadLabels(understood, {}, notes)
    recognition = recognise(
        looked_at,
        pinned,
        search=not holds or len(unknown) > FEW_UNNAMED_SHARE * len(pinned),
        settings=settings,
    )
    if recognition is None or not (holds or recognition.person):
        return ReadLabels(understood, {}, notes)
    sought = unknown if holds else set(wanted)
    found = {f.label: f for f in recognition.markers if f.label in sought and f.label not in of_word}
    found = _on_named_bodies(found, elsewhere, body)
    if holds:  # what nobody asked for need not be listed as ambiguous: a label of no marker, mostly
        found = {label: f for label, f in found.items() if f.confidence >= SURE_ENOUGH}
        found = _without_things_for_legs(found, [atlas()[name].body for name in pinned.values()])
    rows = tuple(_row(found[row.label]) if row.label in found else row for row in understood.labels)
    ratio = (stature(body) or 1.0) / (stature(landmark_mixture(settings).skeleton) or 1.0)
    return ReadLabels(
        Understanding(rows, understood.families if holds else ()),
        {label: _marker(f, body, ratio) for label, f in found.items()},
        (*notes, *_notes(found, rows, contradicted=not holds and bool(meant))),
    )


def _without_things_for_legs(
    found: Mapping[str, FoundMarker], named: Sequence[str]
) -> dict[str, FoundMarker]:
    """Without a few labels on legs of which no name tells: wheels and frames move like something, too."""
    on_leg = {label: f.body[-1] for label, f in found.items() if _part(f.body) in LEG}
    fewest = min(list(on_leg.values()).count(side) for side in "rl")
    if fewest >= FEWEST_OF_A_LEG or any(_part(body) in LEG for body in named):
        return dict(found)
    return {label: f for label, f in found.items() if label not in on_leg}


def _elsewhere_on_their_body(meant: Sequence[UnderstoodLabel]) -> dict[str, UnderstoodLabel]:
    """Labels whose places contradict their names, as others of that part do: those of a frame or a plate."""
    off = {r.label: r for r in meant if not r.used and r.same_as is None and r.body is not None}
    part = Counter(_part(row.body) for row in off.values())
    return {label: row for label, row in off.items() if part[_part(row.body)] > 1}


def _part(body: str | None) -> str:
    return (body or "").removesuffix("_r").removesuffix("_l")


def _on_named_bodies(
    found: Mapping[str, FoundMarker], elsewhere: Mapping[str, UnderstoodLabel], body: Skeleton
) -> dict[str, FoundMarker]:
    """Markers of a frame, tracking the body that their names say, where they were measured; no other body.

    None further from the named place than a decimetre or so, and none of one side alone.
    """
    kept = {label: f for label, f in found.items() if label not in elsewhere}
    near = {}
    for label, row in elsewhere.items():
        f = found.get(label)
        if f is not None and f.body == row.body and row.landmark is not None:
            off = np.linalg.norm(f.place_body - place_on(atlas()[row.landmark], body))
            if off < FRAME_REACH_M:
                near[label] = replace(f, landmark=None, confidence=max(f.confidence, SURE_ENOUGH))
    for label, f in near.items():
        sides = {
            atlas()[elsewhere[n].landmark or ""].side for n, other in near.items() if other.body == f.body
        }
        if sides not in ({"r"}, {"l"}) or f.body.endswith(("_r", "_l")):
            kept[label] = f
    return kept


def _landmark_of(target: str, body: Skeleton) -> str:
    """The landmark that a name of the atlas or of the body's own markers stands for."""
    if target == LEFT_OUT or target in atlas():
        return target
    marker = body.markers[body.marker_names.index(target)]
    near = [mark for mark in atlas().values() if body.body_index(mark.body) == marker.body]
    return min(near, key=lambda mark: float(np.linalg.norm(place_on(mark, body) - marker.position_body))).name


def _only(recordings: Sequence[Markers], wanted: Sequence[str]) -> list[Markers]:
    """The recordings without the other labels."""
    return [
        markers.chosen([i for i, name in enumerate(markers.names) if name in wanted])
        for markers in recordings
    ]


def _marker(found: FoundMarker, body: Skeleton, ratio: float) -> Marker:
    """On a default body of any stature, larger by the ratio than the mixture's."""
    place = found.place_body * ratio if found.landmark is None else place_on(found.landmark, body)
    bony = found.landmark is not None and found.landmark.kind == "bony"
    return Marker(found.label, body.body_index(found.body), place, fixed=bony, spread_m=found.spread_m)


def _row(found: FoundMarker) -> UnderstoodLabel:
    landmark = found.landmark.name if found.landmark else _region(found.body)
    at = found.landmark.says if found.landmark else "no landmark"
    return UnderstoodLabel(
        found.label,
        landmark,
        found.body,
        found.confidence,
        None,
        f"by the motion: moves with {found.body}; {at}",
        tuple((_region(name), p) for name, p in found.alternatives),
    )


def _region(body: str) -> str:
    stem, _, side = body.partition("_")
    return f"{_REGION[stem]}_{side}" if side else _REGION[stem]


def _computed_notes(computed: Sequence[str], unknown: Sequence[str]) -> tuple[Note, ...]:
    if not computed:
        return ()
    notes = [
        Note(
            Kind.LABELS,
            f"{len(computed)} points that software computed from others are no markers and left out: "
            f"{some_of(computed, 3)}; `addb-viewer markers` lists them",
        )
    ]
    if unknown:
        notes += noted(
            Kind.LABELS,
            f"labels that no table has, left out because such a file may hold more computed points: "
            f"{some_of(unknown)}; what is a marker can be named in a map (`addb-viewer markers`)",
        )
    return tuple(notes)


def _notes(
    found: Mapping[str, FoundMarker], rows: Sequence[UnderstoodLabel], contradicted: bool
) -> tuple[Note, ...]:
    notes: list[Note] = []
    if contradicted:
        notes += noted(
            Kind.MODEL_AGAINST_MARKERS,
            "the names of most labels contradict the distances between the markers: not used",
        )
    by_body: dict[str, list[str]] = {}
    for f in found.values():
        if f.confidence >= SURE_ENOUGH:
            at = f" at {f.landmark.name}" if f.landmark else ""
            by_body.setdefault(f.body, []).append(f"{f.label}{at}")
    if by_body:
        listed = some_of([f"{body}: {', '.join(labels)}" for body, labels in by_body.items()])
        notes += noted(
            Kind.LABELS, f"labels without a meaning, attached to the bodies that they move with: {listed}"
        )
    doubtful = [
        f"{f.label} ({' or '.join(f'{b} {p:.2f}' for b, p in ((f.body, f.confidence), *f.alternatives))})"
        for f in found.values()
        if f.confidence < SURE_ENOUGH
    ]
    if doubtful:
        notes += noted(
            Kind.LABELS,
            f"labels without a meaning, on several bodies or on none, left out: {some_of(doubtful)}",
        )
    return tuple(notes)


def disagreeing(recordings: Sequence[Markers]) -> str | None:
    """Two recordings whose labels name different markers, in words; None where all agree.

    Args:
        recordings: of one subject.
    """
    measured = [_distances(markers) for markers in recordings]
    for (i, (mean_a, rigid_a)), (j, (mean_b, rigid_b)) in combinations(enumerate(measured), 2):
        shared = [n for n in recordings[i].names if n in recordings[j].names]
        a = np.ix_(*[[recordings[i].names.index(n) for n in shared]] * 2)
        b = np.ix_(*[[recordings[j].names.index(n) for n in shared]] * 2)
        pairs = np.triu(rigid_a[a] & rigid_b[b], k=1)
        near = (np.minimum(mean_a[a], mean_b[b]) < SEGMENT_REACH_M) & pairs
        if near.sum() < FEWEST_PAIRS:
            continue
        same = np.abs(mean_a[a] - mean_b[b])[near] < SAME_M
        if same.mean() < LEAST_AGREEING_SHARE:
            return (
                f"between recordings {i + 1} and {j + 1}, {np.sum(~same)} of {len(same)} distances within "
                "segments differ"
            )
    return None


def _distances(
    markers: Markers,
) -> tuple[Float[np.ndarray, "markers markers"], Bool[np.ndarray, "markers markers"]]:
    """Mean distance of every two markers [m], and whether it stays."""
    frames = np.unique(np.linspace(0, markers.frames - 1, min(FRAMES, markers.frames)).astype(int))
    x = markers.positions_ground[frames]
    distance = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
    seen = np.isfinite(distance)
    count = np.maximum(1, seen.sum(axis=0))
    mean = np.where(seen, distance, 0.0).sum(axis=0) / count
    deviation = np.sqrt((np.where(seen, distance - mean, 0.0) ** 2).sum(axis=0) / count)
    return mean, (deviation < RIGID_M) & (seen.sum(axis=0) > 1)
