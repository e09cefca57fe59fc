"""A guess from one frame followed over the recording: poses and attachments in turn, then segment lengths.

Which body a marker is on: where it keeps its place over the whole recording, near a landmark.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.kinematics.calibration import CalibrationFrames, calibrate
from solver.kinematics.frame_solver import PoseProblem, aligned, solve_frames, start_postures
from solver.kinematics.settings import EFFECTIVE_FRAMES, KinematicsSettings
from solver.kinematics.unnamed.landmark_mixture import LandmarkMixture
from solver.kinematics.unnamed.settings import (
    ELSEWHERE,
    INDEPENDENT_FRAMES,
    LIMIT_STD_RAD,
    PROPORTIONS_M,
    RIGID_M,
    SCALED_PROPORTIONS_M,
)
from solver.kinematics.unnamed.single_frame import DENSITY_WIDTH_M, of_size
from solver.skeleton.scaling import scaled
from solver.skeleton.skeleton import Marker, Skeleton

ROUNDS = 8  # of pose and attachment in turn
LOOSE_M = 0.04  # [m] deviation of a marker from its place on a body at first, when poses are rough
PULL_STD_RAD = 1.0  # [rad] to the default posture
ROBUST_M = 0.07  # [m] beyond it a marker loses influence on the pose
WALKS_M = 0.5  # [m] who travels further than that, mostly travels forwards
FORWARDS_LOG_ODDS = 3.0  # [nats] that who travels, travels forwards

START_STEPS, FIRST_STEPS, STEPS = 6, 10, 8  # of the poses: rough ones from every start, then of each round
HANDS_FROM = 0.5  # of the rounds: first the forearm is placed
OTHERS_WEIGHT = 0.02  # against the root's markers, in one of the alignments


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
        by_landmark = RIGID_M**2 / (RIGID_M**2 + variance)
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
    frames = np.minimum(INDEPENDENT_FRAMES, count[:, :1])
    score = (
        mixture.log_weight(arms, hands)
        + np.where(seen.allowed, 0.0, -np.inf)
        - 0.5 * away / variance
        - 1.5 * np.log(variance / DENSITY_WIDTH_M**2)
        - 0.5 * frames * moved[:, mixture.body] / tolerance.rigid_m**2
    )
    none = np.log(ELSEWHERE)
    highest = np.maximum(score.max(axis=1), none)
    density = np.exp(score - highest[:, None]) * mixture.context(before)
    total = density.sum(axis=1) + np.exp(none - highest)
    return Attachment(density / total[:, None], highest + np.log(total), mean, moved)


@dataclass(frozen=True)
class Followed:
    """One understanding of the whole recording."""

    q: Float[np.ndarray, "frames dofs"]  # of the mixture's skeleton, in the cloud divided by `size`
    size: float
    arms: bool
    attachment: Attachment
    log_likelihood: float
    factors: Float[np.ndarray, "bodies 3"] | None = None  # of segments, once these were scaled

    def own(self, mixture: LandmarkMixture) -> LandmarkMixture:
        """The landmarks on the body whose segments were scaled."""
        assert self.factors is not None
        return replace(mixture, skeleton=scaled(mixture.skeleton, self.factors))


def follow(
    seen: Seen,
    start_q: Float[np.ndarray, "starts dofs"],
    first: tuple[Float[np.ndarray, "markers landmarks"], Float[np.ndarray, "markers 3"]],
    mixture: LandmarkMixture,
    *,
    size: float,
    arms: bool,
    size_prior: tuple[float, float],
) -> Followed:
    """Poses of all frames and the bodies of all markers.

    Args:
        seen: frames of the recording [m].
        start_q: postures to start from, besides the usual ones; their root does not matter.
        first: shares of the markers' landmarks, and places on their bodies where known (else NaN) [m].
        mixture: of the default body.
        size: of the person against the default body.
        arms: whether arms carry markers.
        size_prior: mean and standard deviation of its logarithm.
    """
    shrunk = replace(seen, points=seen.points / size)
    share, place = first
    body = (share @ mixture.of_body).argmax(axis=1)
    every = np.arange(len(seen.points))
    known = np.isfinite(place).all(axis=1)
    hidden = replace(shrunk, points=np.where(known[None, :, None], shrunk.points, np.nan))
    problem = pose_problem(hidden, body, np.where(known[:, None], place, 0.0), mixture)
    q = _started(problem, start_q, mixture)
    for round_ in range(ROUNDS):
        late = round_ / max(1, ROUNDS - 1)
        loose = LOOSE_M + late * (RIGID_M - LOOSE_M)
        tolerance = Tolerance(loose, PROPORTIONS_M)
        attachment = attach(
            shrunk, q, share, mixture, tolerance=tolerance, arms=arms, hands=late >= HANDS_FROM
        )
        share = attachment.share
        body, expected, variance = attachment.expected(mixture)
        ratio = _size_change(shrunk, q, (body, expected, variance), mixture)
        size *= ratio
        shrunk = replace(seen, points=seen.points / size)
        q = q.copy()
        q[:, mixture.root.translation_dofs] /= ratio
        place = attachment.blended_place(mixture, body)
        q, _ = solve_frames(pose_problem(shrunk, body, place, mixture), q, every, max_iterations=STEPS)
    tolerance = Tolerance(RIGID_M, PROPORTIONS_M)
    attachment = attach(shrunk, q, share, mixture, tolerance=tolerance, arms=arms)
    likely = log_likelihood(attachment, q, mixture) + float(
        of_size(np.array([size]), len(body), size_prior)[0]
    )
    return Followed(q, size, arms, attachment, likely)


def with_segments_scaled(
    seen: Seen, followed: Followed, mixture: LandmarkMixture, size_prior: tuple[float, float]
) -> Followed:
    """The same with the segments' own lengths, by the ordinary scaling; the mixture's places follow them."""
    shrunk = replace(seen, points=seen.points / followed.size)
    body, expected, variance = followed.attachment.expected(mixture)
    spread = np.sqrt(variance + PROPORTIONS_M**2)
    marked = _marked(mixture.skeleton, body, expected, spread)
    weight = np.full(len(seen.points), EFFECTIVE_FRAMES / len(seen.points))
    calibration = calibrate(marked, CalibrationFrames(shrunk.points, weight), mixture.pose_settings)
    own = replace(mixture, skeleton=scaled(mixture.skeleton, calibration.factors))
    problem = PoseProblem(calibration.skeleton, shrunk.points, _loose_poses(mixture), ROBUST_M)
    q, _ = solve_frames(problem, followed.q, np.arange(len(followed.q)))
    tolerance = Tolerance(RIGID_M, SCALED_PROPORTIONS_M)
    attachment = attach(shrunk, q, followed.attachment.share, own, tolerance=tolerance, arms=followed.arms)
    return replace(
        followed,
        q=q,
        attachment=attachment,
        log_likelihood=log_likelihood(attachment, q, own)
        + float(of_size(np.array([followed.size]), len(body), size_prior)[0]),
        factors=calibration.factors,
    )


def forwards(followed: Followed, recording: Int[np.ndarray, " frames"], mixture: LandmarkMixture) -> float:
    """Log odds for the person's front, by the direction of travel: people mostly walk forwards.

    Args:
        followed: the understanding.
        recording: which recording each frame is of; frames in order.
        mixture: of the default body.
    """
    poses = mixture.kinematics.poses(followed.q)
    pelvis = poses.p_ground_body[:, mixture.root.body] * followed.size
    ahead = poses.R_ground_body[:, mixture.root.body, :, 0]
    same = np.diff(recording) == 0
    step = np.diff(pelvis, axis=0)[same][:, [0, 2]]
    along = (step * ahead[:-1][same][:, [0, 2]]).sum()
    travelled = np.linalg.norm(step, axis=1).sum()
    return FORWARDS_LOG_ODDS * along / travelled if travelled > WALKS_M else 0.0


def _started(
    problem: PoseProblem, start_q: Float[np.ndarray, "starts dofs"], mixture: LandmarkMixture
) -> Float[np.ndarray, "frames dofs"]:
    every = np.arange(len(problem.observed))
    near_root = problem.kinematics.marker_bodies == mixture.root.body
    weights = [np.ones(len(near_root))]
    if (near_root & problem.seen.any(axis=0)).sum() >= 3:
        weights.append(np.where(near_root, 1.0, OTHERS_WEIGHT))
    starts = [
        aligned(problem, mixture.root, posture, every, weight)
        for posture in (*start_q, *start_postures(problem.kinematics.skeleton))
        for weight in weights
    ]
    which = np.tile(every, len(starts))
    q, cost = solve_frames(problem, np.concatenate(starts), which, robust=False, max_iterations=START_STEPS)
    best = cost.reshape(len(starts), -1).argmin(axis=0)
    q, _ = solve_frames(
        problem, q.reshape(len(starts), len(every), -1)[best, every], every, max_iterations=FIRST_STEPS
    )
    return q


def pose_problem(
    seen: Seen,
    body: Int[np.ndarray, " markers"],
    place_body: Float[np.ndarray, "markers 3"],
    mixture: LandmarkMixture,
) -> PoseProblem:
    """Poses of the recording's markers on these bodies, at these places [m]."""
    marked = _marked(mixture.skeleton, body, place_body)
    return PoseProblem(marked, seen.points, _loose_poses(mixture), ROBUST_M)


def _loose_poses(mixture: LandmarkMixture) -> KinematicsSettings:
    return replace(mixture.pose_settings, pose_std_rad=PULL_STD_RAD)


def _marked(
    skeleton: Skeleton,
    body: Int[np.ndarray, " markers"],
    place_body: Float[np.ndarray, "markers 3"],
    spread_m: Sequence[float] | Float[np.ndarray, " markers"] | None = None,
) -> Skeleton:
    """The skeleton with the recording's markers, named by their column."""
    spreads = [None] * len(body) if spread_m is None else [float(s) for s in spread_m]
    return skeleton.with_markers(
        [
            Marker(str(i), int(b), p, spread_m=s)
            for i, (b, p, s) in enumerate(zip(body, place_body, spreads, strict=True))
        ]
    )


def _size_change(
    seen: Seen,
    q: Float[np.ndarray, "frames dofs"],
    expected: tuple[
        Int[np.ndarray, " markers"], Float[np.ndarray, "markers 3"], Float[np.ndarray, " markers"]
    ],
    mixture: LandmarkMixture,
) -> float:
    """Factor that brings the cloud to the body's size (Procrustes over all frames)."""
    body, place_body, variance = expected
    poses = mixture.kinematics.poses(q)
    R, p = poses.R_ground_body[:, body], poses.p_ground_body[:, body]
    model = (R @ place_body[None, :, :, None])[..., 0] + p
    weight = np.isfinite(seen.points).all(axis=2) / (variance + RIGID_M**2)
    total = np.maximum(weight.sum(axis=1), 1e-12)[:, None]
    points = np.where(weight[:, :, None] > 0, seen.points, 0.0)
    points = points - ((weight[:, :, None] * points).sum(axis=1) / total)[:, None]
    model = model - ((weight[:, :, None] * model).sum(axis=1) / total)[:, None]
    ratio = (weight * (points * model).sum(axis=2)).sum() / (weight * (model**2).sum(axis=2)).sum()
    return float(np.clip(ratio, 0.9, 1.1))


def log_likelihood(
    attachment: Attachment, q: Float[np.ndarray, "frames dofs"], mixture: LandmarkMixture
) -> float:
    """Of the markers, less the posture's cost in as many frames as are independent.

    Args:
        attachment: of the markers to the bodies in these poses.
        q: the poses [rad or m].
        mixture: at the person's size.
    """
    pull = q - mixture.skeleton.default_q
    pull[:, mixture.root.dofs] = 0.0
    beyond = (q - np.clip(q, *mixture.limits)) / LIMIT_STD_RAD
    posture = ((pull / PULL_STD_RAD) ** 2 + beyond**2).sum(axis=1).mean()
    return float(attachment.log_density.sum() - 0.5 * INDEPENDENT_FRAMES * posture)
