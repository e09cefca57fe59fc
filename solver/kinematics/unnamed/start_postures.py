"""First guesses of size, heading and posture for one frame of a person's markers."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from solver.kinematics.unnamed.landmark_mixture import LandmarkMixture

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
    settings = mixture.settings
    low = points_ground[:, 1].min()
    extent = np.ptp(points_ground[:, 1]) + ABOVE_SOLE_M
    least, most = settings.plausible_size
    sizes = [extent / (share * mixture.crown_m) for share in settings.highest]
    sizes = [s for s in sizes if least < s < most]
    upright = postures(mixture)
    poses = mixture.kinematics.poses(upright)
    root = mixture.root
    q, size = [], []
    for s in sizes or [1.0]:
        middle = np.median(points_ground, axis=0) / s
        floor = np.array([middle[0], low / s - ABOVE_SOLE_M, middle[2]])
        for heading in np.arange(settings.headings) * 2 * np.pi / settings.headings:
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
