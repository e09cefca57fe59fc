"""The default body as a cloud of places where a marker may be: one Gaussian per landmark of the atlas."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.kinematics.marker_terms import MarkerTerms
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unnamed.settings import NAMING, NamingSettings, UnnamedSettings
from solver.markers.atlas import Landmark, atlas, landmark_marker
from solver.markers.label_parts import OTHER_SIDE
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

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


@dataclass(frozen=True)
class LandmarkMixture:
    """All landmarks on one skeleton, as its markers in the atlas's order.

    Everything that sums over landmarks has them on its last axis.
    """

    skeleton: Skeleton
    settings: UnnamedSettings
    pose_settings: KinematicsSettings

    @cached_property
    def landmarks(self) -> tuple[Landmark, ...]:
        """In the order of the skeleton's markers."""
        return tuple(atlas().values())

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
        of_kind = {
            "bony": self.settings.bony,
            "soft": self.settings.soft,
            "cluster": self.settings.cluster,
            "centre": self.settings.centre,
        }
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
        of = self.settings
        others = share.sum(axis=-2, keepdims=True) - share
        on_body = share @ self.of_body
        others_on_body = on_body.sum(axis=-2, keepdims=True) - on_body
        chain = np.minimum(1.0, others_on_body @ self._supporting)
        factor = (of.unsupported + (1 - of.unsupported) * chain)[..., self.body]
        paired, single = np.flatnonzero(self._paired), np.flatnonzero(self._single)
        counterpart = np.minimum(1.0, others[..., self._mirror[paired]])
        factor[..., paired] *= of.one_sided + (1 - of.one_sided) * counterpart
        free = np.maximum(0.0, 1.0 - others[..., single])
        factor[..., single] *= of.shared + (1 - of.shared) * free
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
def landmark_mixture(settings: NamingSettings = NAMING) -> LandmarkMixture:
    """Of the default body at its default size."""
    body = default_skeleton()
    marks = [landmark_marker(mark, mark.name, body) for mark in atlas().values()]
    return LandmarkMixture(body.with_markers(marks), settings.unnamed, settings.kinematics)
