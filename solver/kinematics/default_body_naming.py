"""Recorded labels on the default body: its own markers, and one at its landmark for each label it lacks.

At which spines of the pelvis the fit has markers: what holds the pelvis where some are missing is said.

How high foot markers stand over the sole: a foot that rests on the ground shows it.

The ground is level and the sole of a resting foot lies on it, so there the heights of its markers are those
over the sole, up to one constant. That decides how the foot is pitched and tilted against its markers, which
the usual places of landmarks tell no better than within 5°.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import Markers
from solver.capture.formats.text_table import some_of
from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs
from solver.kinematics.hip_width import LEG_LANDMARKS
from solver.kinematics.label_reading import read_labels
from solver.kinematics.marker_matching import LEFT_OUT, MarkerMatch, known_by_name, match_markers
from solver.kinematics.scale_prior import offset_std
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unnamed.settings import NAMING
from solver.kinematics.upright_pelvis import at_landmarks, on_upright_pelvis
from solver.markers.atlas import atlas, landmark_marker
from solver.markers.label_parts import spelling
from solver.markers.understanding import UnderstoodLabel, understand
from solver.skeleton.skeleton import Marker, Skeleton

SPINES = {
    "asis_r": "right anterior spine (ASIS)",
    "asis_l": "left anterior spine (ASIS)",
    "psis_r": "right posterior spine (PSIS)",
    "psis_l": "left posterior spine (PSIS)",
}

RESTS_M_S = 0.05  # vertical speed below which a marker rests; those of a moving foot pass it within 2-20 ms
RESTS_S = 0.1  # for at least so long, all markers of the foot: the flat phase of a walking step lasts 0.2 s
LOW_M = 0.015  # over the lowest rest of the same foot in the recording: higher up it stands on something else
HEIGHT_STD_M = 0.005  # of a height over the sole: soft shoes, ground, the frames chosen
FOREFOOT_FROM_HEEL_M = 0.08  # markers nearer to each other do not tell the foot's pitch
NOTABLE_M = 1e-4  # a marker whose place is so near stays as it is
# standard deviations; a foot whose heights are further from the usual ones does not lie flat
MOST_SOLE_DEVIATIONS = 3.0


def pelvis_notes(skeleton: Skeleton, match: MarkerMatch, known: Collection[str] = ()) -> tuple[Note, ...]:
    """A note where a spine of the pelvis has no marker; the sacrum stands for both posterior ones.

    Args:
        skeleton: with the model's markers.
        match: which label is which marker.
        known: landmarks that markers sit at though no name tells.
    """
    root = [body for body, joint in enumerate(skeleton.joints) if joint.parent < 0]
    body_of = {marker.name: marker.body for marker in skeleton.markers}
    on_pelvis = [i for i, name in enumerate(match.model) if body_of[name] in root]
    names = [name for i in on_pelvis for name in (match.model[i], *match.measured[i])]
    named = {row.landmark for row in understand(names).labels if row.landmark is not None}
    here = named | set(known)
    missing = [spine for spine in SPINES if spine not in here]
    if "sacrum" in here and not {"psis_r", "psis_l"} & here:
        missing = [spine for spine in missing if not spine.startswith("psis")]
    if not missing:
        return ()
    where = ", ".join(SPINES[spine] for spine in missing)
    held = ", ".join(match.measured[i][0] for i in on_pelvis) or "no marker of its own"
    by_how_much = "its angles and the hips' may be off by some degrees"
    if {"asis_r", "asis_l"} <= set(missing) or {"psis_r", "psis_l"} <= set(missing):
        by_how_much = "only legs and trunk tell its tilt: it, and the hips' flexion, may be off by 15°"
    return noted(Kind.PELVIS, f"no marker at the {where}: the pelvis is held by {held}, and {by_how_much}")


def landmarks_by_name(match: MarkerMatch) -> dict[str, str]:
    """The model's marker at each landmark that its name, or a label's, tells.

    Args:
        match: which label is which marker.
    """
    marker_of = {
        name: model
        for model, labels in zip(match.model, match.measured, strict=True)
        for name in (model, *labels)
    }
    found: dict[str, str] = {}
    for row in understand(list(marker_of)).labels:
        if row.landmark is not None:
            found.setdefault(row.landmark, marker_of[row.label])
    return found


def on_flat_feet(skeleton: Skeleton, match: MarkerMatch, recordings: Sequence[Markers]) -> Skeleton:
    """The skeleton with its foot markers at the heights over the sole that resting feet show.

    Args:
        skeleton: the default body, whose soles are parallel to the x-z planes of calcn and toes.
        match: which label is which marker.
        recordings: of one subject, y up.
    """
    place = {marker.name: marker.position_body for marker in skeleton.markers}
    moved: dict[str, np.ndarray] = {}
    std = dict(zip(skeleton.marker_names, offset_std(skeleton.markers), strict=True))
    for side in "rl":
        foot = [skeleton.body_index(f"{body}_{side}") for body in ("calcn", "toes")]
        names = [m.name for m in skeleton.markers if m.name in match.model and m.body in foot]
        behind = [m.position_body[0] for m in skeleton.markers if m.name in names and m.body == foot[0]]
        if not behind or np.ptp(behind) < FOREFOOT_FROM_HEEL_M:
            continue
        columns = [match.model.index(name) for name in names]
        height = resting_heights([(match.observed(r)[:, columns, 1], r.rate) for r in recordings])
        usual = np.array([place[name][1] for name in names])
        variance = np.array([std[name] for name in names]) ** 2
        shown = np.isfinite(height)
        if not shown.any():
            continue
        raised = height - usual
        raised -= np.average(raised[shown], weights=1 / variance[shown])
        if (np.abs(raised[shown]) > MOST_SOLE_DEVIATIONS * np.sqrt(variance[shown])).any():
            continue
        believed = np.where(shown, raised * variance / (variance + HEIGHT_STD_M**2), 0.0)
        for name, up in zip(names, believed, strict=True):
            if abs(up) > NOTABLE_M:
                moved[name] = place[name] + np.array([0.0, up, 0.0])
    return skeleton.with_markers(
        [replace(m, position_body=moved[m.name]) if m.name in moved else m for m in skeleton.markers]
    )


def resting_heights(
    recordings: Sequence[tuple[Float[np.ndarray, "frames markers"], float]],
) -> Float[np.ndarray, " markers"]:
    """Median height of each marker of one foot while the whole foot rests [m]; NaN where it never does.

    Heights count from the mean of those markers that all rests show, so that the ground's own height, which
    may differ between recordings, drops out.

    Args:
        recordings: heights [m] of the foot's markers, NaN where unseen, and the rate [Hz] of each.
    """
    resting = np.concatenate([height[_at_rest(height, rate)] for height, rate in recordings])
    if not len(resting):
        return np.full(resting.shape[1], np.nan)
    common = np.isfinite(resting).mean(axis=0) > 0.5
    whole = np.isfinite(resting[:, common]).all(axis=1)
    if common.sum() < 2 or not whole.any():
        return np.full(resting.shape[1], np.nan)
    level = resting[whole] - resting[whole][:, common].mean(axis=1, keepdims=True)
    seen = np.isfinite(level).any(axis=0)
    median = np.full(resting.shape[1], np.nan)
    median[seen] = np.nanmedian(level[:, seen], axis=0)
    return median


def _at_rest(height: Float[np.ndarray, "frames markers"], rate: float) -> Bool[np.ndarray, " frames"]:
    """Frames on which every visible marker rests, low, and at least two are visible."""
    if len(height) < 2:
        return np.zeros(len(height), dtype=bool)
    visible = np.isfinite(height)
    slow = ~visible | (np.abs(np.gradient(height, 1 / rate, axis=0)) < RESTS_M_S)
    still = slow.all(axis=1) & (visible.sum(axis=1) >= 2)
    long = np.zeros(len(height), dtype=bool)
    for start, end in runs(still):
        long[start:end] = end - start >= RESTS_S * rate
    if not long.any():
        return long
    lowest = [np.nanmin(column) if np.isfinite(column).any() else np.nan for column in height[long].T]
    return long & (~visible | (height < np.array(lowest) + LOW_M)).all(axis=1)


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
    settings: KinematicsSettings = NAMING,
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
    skeleton = on_flat_feet(skeleton, match, recordings)
    return NamedMarkers(on_upright_pelvis(skeleton, match, recordings), match, landmarks)


def _named(
    generic: Skeleton, recordings: Sequence[Markers], word: Mapping[str, str], settings: KinematicsSettings
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
        (*read.notes, *_notes([r for r in rows if r.label not in read.found], named, word, set(new))),
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
        f"{r.label} ({r.landmark})"
        for r in rows
        if r.label not in word and r.landmark is not None and not r.used and not named.get(r.label)
    ]
    if doubtful:
        notes += noted(
            Kind.UNUSED_LABELS,
            f"labels left out, as their place is not sure or another label has it: {some_of(doubtful)}; "
            f"`addb-viewer markers SUBJECT` says why",
        )
    return tuple(notes)
