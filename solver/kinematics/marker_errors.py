"""How far the fitted skeleton's markers lie from the measured ones, and what a trunk cannot follow.

Markers that ride on a shoulder rise with it, and a body without a shoulder girdle cannot follow: lifting the
arm overhead lifts and tilts the shoulder blade, and the acromion moves by centimetres against the trunk
(Ludewig et al., J Bone Joint Surg Am 2009; 91: 378-389). Nor can a trunk without a neck follow a head.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.notes import Kind, Note
from solver.common.true_runs import runs
from solver.kinematics.label_faults.settings import FEWEST_FRAMES, LOOSEST_HOLD_M
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.rotations import nearest_rotation
from solver.skeleton.skeleton import Skeleton

NEAR_SHOULDER_M = 0.12  # the acromion's skin lies 3 to 8 cm above the joint's centre
FURTHEST_M = 0.13  # a shoulder goes no further; at 19 cm from the acromion is C7, then the head
LEAST_WIDTH_M = 0.06  # from a shoulder to the middle of both; nearer, nobody knows what is inside
# least cosine between where a marker went and up and inwards at 45°: within 37° of it
LEAST_SHRUG_COSINE = 0.8
HEAD_SHARE = 0.5  # of the trunk's length above the shoulders; C7 is at 0.3, C2 at 0.4, the mastoid at 0.65
LEAST_APART_M = 0.06  # from here on a pair's direction is known within 2°, and three markers hold the trunk
# 23°: a marker 10 cm off the neck's axis has gone the 4 cm that are the limit of a marker's error
LEAST_TURN_RAD = 0.4
MOST_TURN_RAD = 2.1  # 120° from the usual posture; two exchanged labels turn a head by 180°


@dataclass(frozen=True)
class MarkerErrors:
    """Distance of each model marker from the raw measured one [m], NaN where unseen."""

    names: tuple[str, ...]  # markers that model and recording share
    distance: Float[np.ndarray, "frames markers"]  # [m]

    @property
    def seen_share(self) -> Float[np.ndarray, " frames"]:
        """Share of the shared markers that each frame shows, 0 to 1."""
        return np.isfinite(self.distance).mean(axis=1)

    @property
    def rms(self) -> float:
        """Root mean square over all seen marker-frames [m]."""
        return float(np.sqrt(np.nanmean(self.distance**2)))

    @property
    def rms_per_frame(self) -> Float[np.ndarray, " frames"]:
        """Root mean square over the markers of each frame [m]; NaN on frames without any."""
        seen = np.isfinite(self.distance)
        squares = np.where(seen, self.distance, 0.0) ** 2
        with np.errstate(invalid="ignore"):
            return np.sqrt(squares.sum(axis=1) / seen.sum(axis=1))

    @property
    def maximum_per_frame(self) -> Float[np.ndarray, " frames"]:
        """Largest distance of each frame [m]; NaN on frames without any."""
        largest = np.where(np.isfinite(self.distance), self.distance, -np.inf).max(axis=1, initial=-np.inf)
        return np.where(np.isfinite(largest), largest, np.nan)

    @property
    def maximum_per_marker(self) -> Float[np.ndarray, " markers"]:
        """Largest distance of each marker [m]; −∞ for one that is never seen."""
        return np.where(np.isfinite(self.distance), self.distance, -np.inf).max(axis=0, initial=-np.inf)

    @property
    def rms_frame_mean(self) -> float:
        """Mean over frames of the per-frame RMS, as peers print it [m]."""
        return float(np.nanmean(self.rms_per_frame))

    @property
    def maximum(self) -> float:
        """Largest distance of all marker-frames [m]."""
        return float(np.nanmax(self.distance))


def marker_errors(
    skeleton: Skeleton,
    names: Sequence[str],
    model_ground: Float[np.ndarray, "frames markers 3"],
    measured_ground: Float[np.ndarray, "frames markers 3"],
    settings: KinematicsSettings,
    *,
    first_frame: int = 0,
) -> tuple[MarkerErrors, tuple[Note, ...]]:
    """Distances of every shared marker, and a note on each that looks slipped, swapped or mislabelled.

    Args:
        skeleton: the fitted one.
        names: of the shared markers, the model's.
        model_ground: of the fitted skeleton [m], y up.
        measured_ground: as recorded, NaN where unseen [m].
        settings: from which distance on a marker is suspect.
        first_frame: how the recording counts the first of these.
    """
    distance = np.linalg.norm(model_ground - measured_ground, axis=2)
    suspect = distance > settings.robust_scale_m
    on_shoulders = shoulder_markers(skeleton) if suspect.any() else frozenset()
    shoulders = [i for i, name in enumerate(names) if name in on_shoulders]
    notes: list[Note] = []
    for i in np.flatnonzero(suspect.any(axis=0)).tolist():
        name, far = names[i], suspect[:, i]
        stretches = ", ".join(f"{first_frame + start}-{first_frame + end - 1}" for start, end in runs(far))
        kind, why = Kind.FAR_MARKERS, "slipped, swapped or mislabelled?"
        if i in shoulders and shrugged(i, shoulders, model_ground[far], measured_ground[far]):
            kind, why = Kind.BARE_BODIES, "the shoulder rose? The model has no shoulder girdle."
        cm = round(100 * float(np.nanmax(distance[:, i])))
        text = f"marker {name} is up to {cm} cm off in frames {stretches}: {why}"
        notes.append(Note(kind, text, values={"marker": name, "cm": cm}))
    return MarkerErrors(tuple(names), distance), tuple(notes)


def shoulder_markers(skeleton: Skeleton) -> frozenset[str]:
    """Names of markers near a shoulder's centre on the trunk, if the upper arms hang on it directly."""
    on_trunk, from_shoulder_m, _ = _on_trunk(skeleton)
    near = on_trunk & (from_shoulder_m < NEAR_SHOULDER_M)
    return frozenset(skeleton.markers[i].name for i in np.flatnonzero(near))


def shrugged(
    marker: int,
    shoulders: Sequence[int],
    model_ground: Float[np.ndarray, "frames markers 3"],
    measured_ground: Float[np.ndarray, "frames markers 3"],
) -> bool:
    """Whether a marker on a shoulder lies above and inside the model's, as where the arm is lifted overhead.

    Above in the ground frame: of somebody who bends over it says no. The arm itself is not looked at.

    Args:
        marker: which one.
        shoulders: it and the others on both shoulders; of one alone nobody knows what is inside.
        model_ground: on the frames in question [m], y up.
        measured_ground: likewise; this marker is seen on all of them.
    """
    went = measured_ground[:, marker] - model_ground[:, marker]
    inwards = model_ground[:, shoulders].mean(axis=1) - model_ground[:, marker]
    inwards[:, 1] = 0.0
    width = np.linalg.norm(inwards, axis=1, keepdims=True)
    far = np.linalg.norm(went, axis=1)
    if width.min() < LEAST_WIDTH_M or far.max() > FURTHEST_M:
        return False
    expected = (inwards / width + [0.0, 1.0, 0.0]) / np.sqrt(2)
    return bool(np.median((went * expected).sum(axis=1) / far) > LEAST_SHRUG_COSINE)


def turned_head(
    skeleton: Skeleton, recordings: Sequence[Float[np.ndarray, "frames markers 3"]]
) -> tuple[tuple[str, ...], float]:
    """Markers of a head that sit on the trunk's body but turn against it as one, and how far at most [rad].

    None where it does not turn, where one marker alone shows it, and where its markers change their distances
    in some recording, as where two are exchanged: that is another fault.

    Args:
        skeleton: unscaled.
        recordings: its markers [m], NaN where unseen.
    """
    on_trunk, _, height = _on_trunk(skeleton)
    head, rest = (np.flatnonzero(on_trunk & above) for above in (height > HEAD_SHARE, height <= HEAD_SHARE))
    turn = max((_turn(x, head, rest) for x in recordings), default=0.0)
    turns = LEAST_TURN_RAD < turn < MOST_TURN_RAD
    return tuple(skeleton.markers[i].name for i in head if turns), turn


def _turn(
    x: Float[np.ndarray, "frames markers 3"], head: Int[np.ndarray, " head"], rest: Int[np.ndarray, " rest"]
) -> float:
    """How far the head turns from its usual posture [rad]; ∞ if its markers do not keep their distances."""
    seen = np.isfinite(x).all(axis=2)
    usual = 2 * seen.sum(axis=0) > seen.any(axis=1).sum()
    head, rest = head[usual[head]], rest[usual[rest]]
    a, b = head[np.array(np.triu_indices(len(head), 1))]
    length = np.linalg.norm(x[:, a] - x[:, b], axis=2)
    off = np.abs(length - np.nanmedian(length, axis=0)) > LOOSEST_HOLD_M
    if (off.sum(axis=0) >= FEWEST_FRAMES).any():
        return np.inf
    x = x[seen[:, [*head, *rest]].all(axis=1)]
    if len(rest) < 3 or len(x) < FEWEST_FRAMES:
        return 0.0
    placed = x[:, rest] - x[:, rest].mean(axis=1, keepdims=True)
    shape, between = placed[len(x) // 2], x[:, a] - x[:, b]
    if np.linalg.svd(shape, compute_uv=False)[1] < LEAST_APART_M:
        return 0.0
    between = between @ nearest_rotation(np.einsum("tmi,mj->tij", placed, shape))
    between = between[:, np.linalg.norm(between, axis=2).min(axis=0) > LEAST_APART_M]
    between /= np.linalg.norm(between, axis=2, keepdims=True)
    middle = np.median(between, axis=0)
    cosine = (between * middle).sum(axis=2) / np.linalg.norm(middle, axis=1)
    farthest = np.sort(cosine.min(axis=1, initial=1.0))[FEWEST_FRAMES - 1]
    return float(np.arccos(np.clip(farthest, -1.0, 1.0)))


def _on_trunk(
    skeleton: Skeleton,
) -> tuple[Bool[np.ndarray, " markers"], Float[np.ndarray, " markers"], Float[np.ndarray, " markers"]]:
    """Of each marker whether it sits on a trunk that both arms hang on, with no shoulder blade between.

    And its distance from the nearer shoulder [m], and its height above both in lengths of the trunk.
    """
    kinematics = ForwardKinematics(skeleton)
    poses = kinematics.poses(skeleton.default_q[None])
    places, origins = kinematics.markers(poses)[0], poses.p_ground_body[0]
    arms = [i for i, name in enumerate(skeleton.body_names) if name.startswith("humerus")]
    parents = [skeleton.joints[arm].parent for arm in arms]
    trunk = next((parent for parent in parents if parent >= 0 and parents.count(parent) > 1), None)
    if trunk is None:
        return np.zeros(len(places), dtype=bool), np.full(len(places), np.inf), np.zeros(len(places))
    shoulders = origins[[arm for arm, parent in zip(arms, parents, strict=True) if parent == trunk]]
    top, on_trunk = shoulders[:, 1].mean(), np.array([marker.body == trunk for marker in skeleton.markers])
    from_shoulder_m = np.linalg.norm(places[:, None] - shoulders, axis=2).min(axis=1)
    return on_trunk, from_shoulder_m, (places[:, 1] - top) / (top - origins[trunk, 1])
