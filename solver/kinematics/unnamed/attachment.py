"""Which body a marker is on: where it keeps its place over the whole recording, near a landmark."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.kinematics.unnamed.landmark_mixture import LandmarkMixture
from solver.kinematics.unnamed.single_frame import DENSITY_WIDTH_M


@dataclass(frozen=True)
class Tolerance:
    """How strictly markers are held to bodies and landmarks [m]."""

    rigid_m: float
    proportions_m: float


@dataclass(frozen=True)
class Attachment:
    """Every marker's landmarks, weighed, and its measured place on every body."""

    share: Float[np.ndarray, "markers landmarks"]  # probability of each landmark; the rest is "none"
    log_density: Float[np.ndarray, " markers"]
    place_body: Float[np.ndarray, "markers bodies 3"]  # mean over frames [m]
    moved_m2: Float[np.ndarray, "markers bodies"]  # variance of the place over frames

    def on_body(self, mixture: LandmarkMixture) -> Float[np.ndarray, "markers bodies"]:
        """Probability that each marker is on each body."""
        return self.share @ mixture.of_body

    def expected(
        self, mixture: LandmarkMixture
    ) -> tuple[Int[np.ndarray, " markers"], Float[np.ndarray, "markers 3"], Float[np.ndarray, " markers"]]:
        """Each marker's likeliest body, and mean place there [m] and variance [m²] by the landmarks alone."""
        body = self.on_body(mixture).argmax(axis=1)
        return body, *self._by_landmarks(mixture, body)

    def blended_place(
        self, mixture: LandmarkMixture, body: Int[np.ndarray, " markers"]
    ) -> Float[np.ndarray, "markers 3"]:
        """Each marker's place on the given body [m]: as measured, drawn to its landmarks there."""
        expected, variance = self._by_landmarks(mixture, body)
        measured = self.place_body[np.arange(len(body)), body]
        by_landmark = mixture.settings.rigid_m**2 / (mixture.settings.rigid_m**2 + variance)
        return measured + by_landmark[:, None] * (expected - measured)

    def _by_landmarks(
        self, mixture: LandmarkMixture, body: Int[np.ndarray, " markers"]
    ) -> tuple[Float[np.ndarray, "markers 3"], Float[np.ndarray, " markers"]]:
        own = self.share * (mixture.body[None] == body[:, None])
        own = own / np.maximum(own.sum(axis=1, keepdims=True), 1e-12)
        return own @ mixture.place_body, own @ mixture.variance


@dataclass(frozen=True)
class Seen:
    """Frames of a recording that the search looks at, and what each marker may be."""

    points: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen
    allowed: Bool[np.ndarray, "markers landmarks"]


def attach(
    seen: Seen,
    q: Float[np.ndarray, "frames dofs"],
    before: Float[np.ndarray, "markers landmarks"],
    mixture: LandmarkMixture,
    *,
    tolerance: Tolerance,
    arms: bool,
    hands: bool = True,
) -> Attachment:
    """Weigh every landmark of every marker, given the poses.

    A marker that is at a landmark of a body has its mean place there and hardly moves on that body: both are
    Gaussian, the movement counted in as many frames as are independent.

    Args:
        seen: the markers.
        q: poses of the mixture's skeleton [rad or m].
        before: the shares of the round before.
        mixture: at the person's size.
        tolerance: widths of the two.
        arms: whether arms carry markers.
        hands: whether hands may carry markers.
    """
    poses = mixture.kinematics.poses(q)
    from_origin = seen.points[:, :, None] - poses.p_ground_body[:, None]
    place = np.einsum("fbji,fmbj->fmbi", poses.R_ground_body, from_origin, optimize=True)
    visible = np.isfinite(place).all(axis=3)
    count = np.maximum(1, visible.sum(axis=0))
    mean = np.where(visible[..., None], place, 0.0).sum(axis=0) / count[..., None]
    moved = (np.where(visible[..., None], place - mean, 0.0) ** 2).sum(axis=(0, 3)) / count
    away = ((mean[:, mixture.body] - mixture.place_body) ** 2).sum(axis=2)
    variance = tolerance.proportions_m**2 + mixture.variance
    frames = np.minimum(mixture.settings.independent_frames, count[:, :1])
    score = (
        mixture.log_weight(arms, hands)
        + np.where(seen.allowed, 0.0, -np.inf)
        - 0.5 * away / variance
        - 1.5 * np.log(variance / DENSITY_WIDTH_M**2)
        - 0.5 * frames * moved[:, mixture.body] / tolerance.rigid_m**2
    )
    none = np.log(mixture.settings.elsewhere)
    highest = np.maximum(score.max(axis=1), none)
    density = np.exp(score - highest[:, None]) * mixture.context(before)
    total = density.sum(axis=1) + np.exp(none - highest)
    return Attachment(density / total[:, None], highest + np.log(total), mean, moved)
