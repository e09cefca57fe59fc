"""The default body as a cloud of places where a marker may be: one Gaussian per landmark of the atlas.

Which markers of one body are at its landmarks, by the shape that they make.

Poses are found with the markers where they were first thought to be, and a body that turned towards a wrong
marker confirms it. The distances between markers of one body do not depend on its pose: here the body is laid
anew on its markers for every choice. A landmark goes to the marker with which the shape is likelier, and a
marker with a rival is held as loosely as the two lie apart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.kinematics.marker_terms import MarkerTerms
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unnamed.settings import NAMING, SCALED_PROPORTIONS_M
from solver.markers.atlas import Landmark, atlas, landmark_marker
from solver.markers.label_parts import OTHER_SIDE
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.rotations import nearest_rotation
from solver.skeleton.skeleton import Skeleton

BONY = 1.0  # weight of a bony landmark before anything is seen: most used
SOFT = 0.3  # likewise of a place on soft tissue
CLUSTER = 0.5  # likewise of a place somewhere on a segment
CENTRE = 0.1  # likewise of a joint's centre: few recordings hold computed ones
UNSUPPORTED = 0.03  # chance of a hand with no marker on the forearm, and the like
ONE_SIDED = 0.3  # chance of a place whose counterpart on the other side carries no marker
SHARED = 0.02  # chance of a place that another marker has

ARM = ("humerus", "ulna", "radius", "hand")
# a marker on the body before the colon is believed when another one is on one of those behind it
_SUPPORT = {
    "pelvis": ("pelvis", "femur", "torso"),
    "femur": ("pelvis", "femur", "tibia"),
    "tibia": ("femur", "tibia", "calcn"),
    "patella": ("femur",),
    "talus": ("tibia",),
    "calcn": ("tibia", "toes"),
    "toes": ("calcn",),
    "torso": ("torso", "pelvis", "humerus"),
    "humerus": ("humerus", "ulna", "radius", "hand"),
    "ulna": ("humerus",),
    "radius": ("humerus",),
    "hand": ("radius",),
}

# landmarks of a body whose shape is looked at; with three, most markers make a likely shape
FEWEST_LANDMARKS = 4
REPLACING_GAIN_NATS = float(
    np.log(3.0)
)  # log likelihood that another marker must gain; else what was found first stays


@dataclass(frozen=True)
class LandmarkMixture:
    """All landmarks on one skeleton, as its markers in the atlas's order.

    Everything that sums over landmarks has them on its last axis.
    """

    skeleton: Skeleton
    pose_settings: KinematicsSettings

    @cached_property
    def landmarks(self) -> tuple[Landmark, ...]:
        """In the order of the skeleton's markers."""
        return tuple(atlas()[name] for name in self.skeleton.marker_names)

    @cached_property
    def kinematics(self) -> ForwardKinematics:
        """Of the skeleton with the landmarks."""
        return ForwardKinematics(self.skeleton)

    @cached_property
    def terms(self) -> MarkerTerms:
        """Gauss-Newton terms of the landmarks."""
        return MarkerTerms(self.kinematics)

    @cached_property
    def root(self) -> RootJoint:
        """The skeleton's free joint."""
        return root_joint(self.skeleton)

    @cached_property
    def body(self) -> Int[np.ndarray, " landmarks"]:
        """Body index of each landmark."""
        return self.kinematics.marker_bodies

    @cached_property
    def place_body(self) -> Float[np.ndarray, "landmarks 3"]:
        """Of each landmark in its body's frame [m]."""
        return self.kinematics.marker_offsets

    @cached_property
    def variance(self) -> Float[np.ndarray, " landmarks"]:
        """Of a marker's place about its landmark [m²]."""
        return np.array([mark.spread_m for mark in self.landmarks]) ** 2

    @cached_property
    def of_body(self) -> Float[np.ndarray, "landmarks bodies"]:
        """1 where the landmark is on the body."""
        return (self.body[:, None] == np.arange(len(self.skeleton.bodies))).astype(float)

    @cached_property
    def limits(self) -> Float[np.ndarray, "2 dofs"]:
        """Least and greatest q [rad]; none for the root."""
        ranges = np.array([c.range for c in self.skeleton.free_coordinates]).T
        ranges[:, self.root.dofs] = np.array([[-np.inf], [np.inf]])
        return ranges

    @cached_property
    def crown_m(self) -> float:
        """Height of the top of the head over the sole, upright [m]."""
        x = self.kinematics.markers(self.kinematics.poses(self.skeleton.default_q[None]))[0]
        return float(x[self.landmarks.index(atlas()["head_top"]), 1])

    def log_weight(self, arms: bool, hands: bool = True) -> Float[np.ndarray, " landmarks"]:
        """Log probability that a marker is at each landmark, before anything is seen.

        Args:
            arms: whether arms carry markers; without them the other landmarks have a larger share.
            hands: likewise of hands alone, which follow any marker as long as the arm does not hold them.
        """
        of_kind = {"bony": BONY, "soft": SOFT, "cluster": CLUSTER, "centre": CENTRE}
        bare = () if arms and hands else ("hand",) if arms else ARM
        weight = np.array(
            [0.0 if mark.body.split("_")[0] in bare else of_kind[mark.kind] for mark in self.landmarks]
        )
        with np.errstate(divide="ignore"):
            return np.log(weight / weight.sum())

    def context(
        self, share: Float[np.ndarray, "*batch markers landmarks"]
    ) -> Float[np.ndarray, "*batch markers landmarks"]:
        """Factor of the density for every marker and landmark, by where the other markers are.

        Bodies are marked in chains, not a hand alone; people mark both sides alike; and two markers are
        rarely put on one bony place.

        Args:
            share: probability of each landmark for each marker, of the round before.
        """
        others = share.sum(axis=-2, keepdims=True) - share
        on_body = share @ self.of_body
        others_on_body = on_body.sum(axis=-2, keepdims=True) - on_body
        chain = np.minimum(1.0, others_on_body @ self._supporting)
        factor = (UNSUPPORTED + (1 - UNSUPPORTED) * chain)[..., self.body]
        paired, single = np.flatnonzero(self._paired), np.flatnonzero(self._single)
        counterpart = np.minimum(1.0, others[..., self._mirror[paired]])
        factor[..., paired] *= ONE_SIDED + (1 - ONE_SIDED) * counterpart
        free = np.maximum(0.0, 1.0 - others[..., single])
        factor[..., single] *= SHARED + (1 - SHARED) * free
        return factor

    @cached_property
    def _mirror(self) -> Int[np.ndarray, " landmarks"]:
        """Each landmark's counterpart on the other side; in the midline itself."""
        order = {mark.name: i for i, mark in enumerate(self.landmarks)}
        return np.array(
            [
                order[f"{mark.name[:-1]}{OTHER_SIDE[mark.side]}"] if mark.side else i
                for i, mark in enumerate(self.landmarks)
            ]
        )

    @cached_property
    def _paired(self) -> Bool[np.ndarray, " landmarks"]:
        return np.array([mark.side is not None for mark in self.landmarks])

    @cached_property
    def _single(self) -> Bool[np.ndarray, " landmarks"]:
        """Whether it is one place, not a region."""
        return np.array([not mark.tracks_only for mark in self.landmarks])

    @cached_property
    def _supporting(self) -> Float[np.ndarray, "bodies bodies"]:
        """Entry (b, c): whether a marker on b supports one on c."""
        names = self.skeleton.body_names
        matrix = np.zeros((len(names), len(names)))
        for c, name in enumerate(names):
            stem, _, side = name.partition("_")
            for b, other in enumerate(names):
                other_stem, _, other_side = other.partition("_")
                same_side = not side or not other_side or side == other_side
                matrix[b, c] = float(same_side and other_stem in _SUPPORT[stem])
        return matrix


@cache
def landmark_mixture(settings: KinematicsSettings = NAMING) -> LandmarkMixture:
    """Of the default body at its default size, without what poses alone tell."""
    body = default_skeleton()
    marks = [landmark_marker(m, m.name, body) for m in atlas().values() if m.kind != "pose"]
    return LandmarkMixture(body.with_markers(marks), settings)


@dataclass(frozen=True)
class BodyShape:
    """The landmarks of one body on its markers."""

    at: Mapping[int, Landmark]  # marker to landmark
    spread_m: Mapping[int, float]  # how far each of these may lie from its landmark
    place_body: Mapping[int, Float[np.ndarray, "3"]]  # [m] of every marker, the body laid on its landmarks


def by_shape(
    at: Mapping[int, Landmark], measured_body: Mapping[int, Float[np.ndarray, "3"]], mixture: LandmarkMixture
) -> BodyShape:
    """Give the landmarks of one body to the markers that make the likeliest shape, one change at a time.

    Args:
        at: the landmarks of its markers, as thought.
        measured_body: places [m] of all its markers in its frame, in poses that may be wrong.
        mixture: at the person's size, segments scaled.
    """
    now = _Laid(at, measured_body, mixture)
    if len(at) < FEWEST_LANDMARKS:
        spreads = {i: mark.spread_m for i, mark in at.items()}
        return BodyShape(dict(at), spreads, dict(measured_body))
    while True:
        best = min(now.others(), key=lambda other: other.misfit, default=now)
        if best.misfit > now.misfit - REPLACING_GAIN_NATS:
            break
        now = best
    places = now.places() if now.at != at else dict(measured_body)
    return BodyShape(now.at, {i: now.spread(i) for i in now.at}, places)


@dataclass(frozen=True)
class _Laid:
    """A choice of markers for the landmarks, and the body laid on them (Kabsch)."""

    at: Mapping[int, Landmark]
    measured: Mapping[int, Float[np.ndarray, "3"]]
    mixture: LandmarkMixture

    def others(self, loser: int | None = None) -> Sequence["_Laid"]:
        """All choices in which one landmark, or the loser's, goes to a marker that has none."""
        free = [i for i in self.measured if i not in self.at]
        return [
            _Laid({j if i == lost else i: mark for i, mark in self.at.items()}, self.measured, self.mixture)
            for lost in self.at
            if loser in (None, lost)
            for j in free
        ]

    @cached_property
    def misfit(self) -> float:
        """Half the squared deviations from the landmarks, in their standard deviations."""
        landmarks, variance = self._landmarks
        laid = self.places()
        off = np.array([laid[i] for i in self.at]) - landmarks
        return float(0.5 * ((off**2).sum(axis=1) / variance).sum())

    def spread(self, marker: int) -> float:
        """Of the marker about its landmark [m]: wider where others may be there in its place."""
        mark = self.at[marker]
        rivals = self.others(marker)
        odds = np.exp([min(0.0, self.misfit - rival.misfit) for rival in rivals])
        apart = [
            float(
                np.linalg.norm(
                    self.measured[next(iter(rival.at.keys() - self.at.keys()))] - self.measured[marker]
                )
            )
            for rival in rivals
        ]
        doubt = float(odds @ np.square(apart)) / (1 + odds.sum()) if rivals else 0.0
        return float(np.sqrt(mark.spread_m**2 + doubt))

    def places(self) -> dict[int, Float[np.ndarray, "3"]]:
        """Of all markers in the frame of the body as it is laid [m]."""
        landmarks, variance = self._landmarks
        weight = (1 / variance) / (1 / variance).sum()
        points = np.array([self.measured[i] for i in self.at])
        from_points, to_landmarks = weight @ points, weight @ landmarks
        R = nearest_rotation(np.einsum("m,mi,mj->ij", weight, landmarks - to_landmarks, points - from_points))
        return {i: R @ (p - from_points) + to_landmarks for i, p in self.measured.items()}

    @cached_property
    def _landmarks(self) -> tuple[Float[np.ndarray, "marks 3"], Float[np.ndarray, " marks"]]:
        """Places [m] and variances [m²] of the landmarks, in the order of `at`."""
        index = [self.mixture.landmarks.index(mark) for mark in self.at.values()]
        room = SCALED_PROPORTIONS_M**2
        return self.mixture.place_body[index], self.mixture.variance[index] + room
