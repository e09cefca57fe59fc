"""The default body laid over the markers of one frame: soft assignment and pose in turn, ever sharper.

The markers are drawn from a mixture of Gaussians about the landmarks (Myronenko & Song 2010,
10.1109/TPAMI.2010.46), which move with the pose of the body. Many guesses are followed at once.

First guesses of size, heading and posture for one frame of a person's markers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from solver.kinematics.unnamed.landmark_mixture import LandmarkMixture
from solver.kinematics.unnamed.settings import ELSEWHERE, LIMIT_STD_RAD

HEADINGS = 8  # of the first guesses; an eighth of a turn is well within reach of the alignment
# of the stature: where the highest marker is, on the head, the shoulders, or the waist
HIGHEST = (1.0, 0.84, 0.60)
PLAUSIBLE_SIZE = (0.5, 1.25)  # against the default body: small children to giants
# [m] the mixture narrows: from a coarse likeness of a body to marker places
WIDTHS_M = (0.15, 0.137, 0.124, 0.111, 0.099, 0.086, 0.073, 0.06, 0.06, 0.055, 0.05, 0.045, 0.04, 0.035, 0.03)
COARSE_WIDTHS = 8  # after so many only the better half of the guesses is followed
GUESSES_FOLLOWED = 48  # guesses that go on after the coarse widths
POSTURE_STD_RAD = 0.6  # [rad] about the start posture, while one frame is all there is
MOST_TURN_RAD = 0.5  # [rad] in one step: larger ones leave the linear range

ABOVE_SOLE_M = 0.03  # centre of the lowest marker of a usual set
_POSTURES: tuple[dict[str, float], ...] = (  # [rad]; upright, what arms do, strides, running
    {},
    {"elbow_flex_r": 1.5, "elbow_flex_l": 1.5},
    {"hip_flexion_r": 0.5, "hip_flexion_l": -0.3, "knee_angle_r": 0.3, "knee_angle_l": 0.6},
    {"hip_flexion_l": 0.5, "hip_flexion_r": -0.3, "knee_angle_l": 0.3, "knee_angle_r": 0.6},
    {"arm_add_r": -1.3, "arm_add_l": -1.3},
    {
        "hip_flexion_r": 0.2, "hip_flexion_l": 0.6, "knee_angle_r": 0.3, "knee_angle_l": 1.5,
        "elbow_flex_r": 1.5, "elbow_flex_l": 1.5,
    },
    {
        "hip_flexion_l": 0.2, "hip_flexion_r": 0.6, "knee_angle_l": 0.3, "knee_angle_r": 1.5,
        "elbow_flex_r": 1.5, "elbow_flex_l": 1.5,
    },
)  # fmt: skip

DENSITY_WIDTH_M = 0.05  # densities are in units of a Gaussian's of this width
# of three dimensions: errors of proportion are shared, so markers are no independent direct checks
SHRINKING = 1.0
CHUNK = 8  # guesses weighed together: their arrays stay in the processor's cache
LEAST_WEIGHT = 1e-9  # below it a landmark pulls nothing


@dataclass(frozen=True)
class Guesses:
    """Poses of the default body in the measured cloud divided by `size`."""

    q: Float[np.ndarray, "guesses dofs"]
    size: Float[np.ndarray, " guesses"]  # of the person against the default body
    arms: Bool[np.ndarray, " guesses"]  # whether arms carry markers

    def some(self, which: np.ndarray) -> "Guesses":
        """Those of an index or mask."""
        return Guesses(self.q[which], self.size[which], self.arms[which])


def postures(mixture: LandmarkMixture) -> Float[np.ndarray, "postures dofs"]:
    """Usual ones, the pelvis as in the default pose."""
    dofs = mixture.skeleton.dofs
    found = np.tile(mixture.skeleton.default_q, (len(_POSTURES), 1))
    for q, angles in zip(found, _POSTURES, strict=True):
        for name, angle in angles.items():
            q[dofs.index(name)] = angle
    return found


def first_guesses(points_ground: Float[np.ndarray, "markers 3"], mixture: LandmarkMixture) -> Guesses:
    """Every usual posture in every heading, at sizes that the cloud's height allows; with arms and without.

    Args:
        points_ground: of one frame, y up [m].
        mixture: of the default body.
    """
    low = points_ground[:, 1].min()
    extent = np.ptp(points_ground[:, 1]) + ABOVE_SOLE_M
    least, most = PLAUSIBLE_SIZE
    sizes = [extent / (share * mixture.crown_m) for share in HIGHEST]
    sizes = [s for s in sizes if least < s < most]
    upright = postures(mixture)
    poses = mixture.kinematics.poses(upright)
    root = mixture.root
    q, size = [], []
    for s in sizes or [1.0]:
        middle = np.median(points_ground, axis=0) / s
        floor = np.array([middle[0], low / s - ABOVE_SOLE_M, middle[2]])
        for heading in np.arange(HEADINGS) * 2 * np.pi / HEADINGS:
            turn = Rotation.from_rotvec([0.0, heading, 0.0]).as_matrix()
            R = turn @ poses.R_ground_body[:, root.body]
            p = poses.p_ground_body[:, root.body] @ turn.T + floor
            turned = upright.copy()
            turned[:, root.dofs] = root.coordinates(R, p)
            q.append(turned)
            size.append(np.full(len(turned), s))
    guesses = Guesses(np.concatenate(q), np.concatenate(size), np.ones(sum(map(len, q)), dtype=bool))
    twice = np.tile(np.arange(len(guesses.q)), 2)
    arms = np.arange(len(twice)) < len(guesses.q)
    return Guesses(guesses.q[twice], guesses.size[twice], arms)


@dataclass(frozen=True)
class LaidOver:
    """Guesses after alignment, the best first."""

    guesses: Guesses
    log_likelihood: Float[np.ndarray, " guesses"]  # of the markers, with the posture's cost
    share: Float[np.ndarray, "guesses markers landmarks"]  # probability of each landmark; the rest is "none"


def lay_over(
    points_ground: Float[np.ndarray, "markers 3"],
    allowed: Bool[np.ndarray, "markers landmarks"],
    mixture: LandmarkMixture,
    size_prior: tuple[float, float],
) -> LaidOver:
    """Align the body to one frame.

    Args:
        points_ground: of the frame's seen markers, y up [m].
        allowed: which landmarks each may be.
        mixture: of the default body.
        size_prior: mean and standard deviation of the logarithm of the person's size.
    """
    guesses = first_guesses(points_ground, mixture)
    start = guesses.q
    coarse = WIDTHS_M[:COARSE_WIDTHS]
    rough = _sharpened(guesses, start, (points_ground, allowed), mixture, coarse)
    likely = rough.log_likelihood + of_size(guesses.size, len(points_ground), size_prior)
    kept = np.argsort(-likely)[:GUESSES_FOLLOWED]
    fine = WIDTHS_M[COARSE_WIDTHS:]
    found = _sharpened(rough.guesses.some(kept), start[kept], (points_ground, allowed), mixture, fine)
    likely = found.log_likelihood + of_size(found.guesses.size, len(points_ground), size_prior)
    order = np.argsort(-likely)
    return LaidOver(found.guesses.some(order), likely[order], found.share[order])


def of_size(
    size: Float[np.ndarray, " guesses"], markers: int, prior: tuple[float, float]
) -> Float[np.ndarray, " guesses"]:
    """What a size adds to the log likelihood: its prior, and that densities of a shrunk cloud are higher."""
    mean, std = prior
    return -0.5 * ((np.log(size) - mean) / std) ** 2 - SHRINKING * markers * np.log(size)


def _sharpened(
    guesses: Guesses,
    start: Float[np.ndarray, "guesses dofs"],
    frame: tuple[Float[np.ndarray, "markers 3"], Bool[np.ndarray, "markers landmarks"]],
    mixture: LandmarkMixture,
    widths_m: Sequence[float],
) -> LaidOver:
    points_ground, allowed = frame
    points = points_ground[None] / guesses.size[:, None, None]
    weights = np.where(guesses.arms[:, None], mixture.log_weight(arms=True), mixture.log_weight(arms=False))[
        :, None
    ] + np.where(allowed, 0.0, -np.inf)
    q, context = guesses.q, np.ones(weights.shape)
    share, log_density = np.empty_like(context), np.empty(context.shape[:2])
    for width in widths_m:
        poses = mixture.kinematics.poses(q)
        places = mixture.kinematics.markers(poses)
        weight, target = np.empty(places.shape[:2]), np.empty_like(places)
        for first in range(0, len(q), CHUNK):
            some = slice(first, first + CHUNK)
            share[some], log_density[some] = _shares(
                (points[some], places[some]), weights[some], context[some], mixture, width
            )
            context[some] = mixture.context(share[some])
            pull = share[some] / (width**2 + mixture.variance)
            weight[some], target[some] = pull.sum(axis=1), pull.transpose(0, 2, 1) @ points[some]
        target /= np.maximum(weight, LEAST_WEIGHT)[:, :, None]
        error = np.where(weight[:, :, None] > LEAST_WEIGHT, places - target, 0.0)
        H, g = mixture.terms.normal_equations(poses, places, error, weight)
        cost, gradient, diagonal = _posture_cost(q, start, mixture)
        dofs = np.arange(q.shape[1])
        H[:, dofs, dofs] += diagonal
        step = -np.linalg.solve(H, (g + gradient)[:, :, None])[:, :, 0]
        turned = np.delete(step, mixture.root.translation_dofs, axis=1)
        largest = np.abs(turned).max(axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, MOST_TURN_RAD / np.maximum(largest, 1e-9))
    return LaidOver(Guesses(q, guesses.size, guesses.arms), log_density.sum(axis=1) - 0.5 * cost, share)


def _shares(
    seen: tuple[Float[np.ndarray, "guesses markers 3"], Float[np.ndarray, "guesses landmarks 3"]],
    log_weight: Float[np.ndarray, "guesses markers landmarks"],
    context: Float[np.ndarray, "#guesses #markers #landmarks"],
    mixture: LandmarkMixture,
    width_m: float,
) -> tuple[Float[np.ndarray, "guesses markers landmarks"], Float[np.ndarray, "guesses markers"]]:
    """Probability of each landmark for each marker, and the log density of the marker.

    Args:
        seen: the markers, and where the landmarks are [m].
        log_weight: of the landmarks, before anything is seen.
        context: factors by where the other markers are.
        mixture: of the default body.
        width_m: of the Gaussians, besides each landmark's own.
    """
    points, places = seen
    variance = width_m**2 + mixture.variance
    precision = 1.0 / variance
    # −|x − p|²/2σ² in one product of matrices
    score = points @ (places * precision[:, None]).transpose(0, 2, 1)
    score += log_weight
    score -= 0.5 * (points**2).sum(axis=2)[:, :, None] * precision
    score -= (0.5 * (places**2).sum(axis=2) * precision + 1.5 * np.log(variance / DENSITY_WIDTH_M**2))[
        :, None
    ]
    none = np.log(ELSEWHERE) - 3.0 * np.log(width_m / DENSITY_WIDTH_M)
    highest = np.maximum(score.max(axis=2), none)
    score -= highest[:, :, None]
    density = np.exp(score, out=score)
    density *= context
    total = density.sum(axis=2) + np.exp(none - highest)
    density /= total[:, :, None]
    return density, highest + np.log(total)


def _posture_cost(
    q: Float[np.ndarray, "guesses dofs"], start: Float[np.ndarray, "guesses dofs"], mixture: LandmarkMixture
) -> tuple[
    Float[np.ndarray, " guesses"], Float[np.ndarray, "guesses dofs"], Float[np.ndarray, "guesses dofs"]
]:
    """Cost, gradient and diagonal of the joints' limits and of the pull to the start posture."""
    precision = np.full(q.shape[1], POSTURE_STD_RAD**-2)
    precision[mixture.root.dofs] = 0.0
    stiffness = LIMIT_STD_RAD**-2
    away, beyond = q - start, q - np.clip(q, *mixture.limits)
    cost = (precision * away**2).sum(axis=1) + stiffness * (beyond**2).sum(axis=1)
    return cost, precision * away + stiffness * beyond, precision + stiffness * (beyond != 0) + 1e-6
