"""Joint-angle patterns over one gait cycle: our own sketches of what textbooks draw, not anyone's recording.

Phase 0 is the foot's own contact, phase 1 its next. Angles are in degrees, signs OpenSim's.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

Knots = tuple[tuple[float, float], ...]

WALKING_LEG: Mapping[str, Knots] = {
    "hip_flexion": ((0, 27), (0.12, 23), (0.3, 3), (0.5, -13), (0.62, -4), (0.75, 18), (0.87, 29)),
    "hip_adduction": ((0, -1), (0.15, 5), (0.35, 3), (0.5, 1), (0.63, -6), (0.8, -3)),
    "hip_rotation": ((0, -2), (0.2, 3), (0.5, 1), (0.65, -3), (0.85, -1)),
    "knee_angle": (
        (0, 5),
        (0.13, 17),
        (0.27, 11),
        (0.41, 5),
        (0.52, 12),
        (0.62, 38),
        (0.73, 60),
        (0.87, 27),
        (0.96, 5),
    ),
    "ankle_angle": (
        (0, 1),
        (0.06, -5),
        (0.14, 0),
        (0.3, 6),
        (0.45, 11),
        (0.54, 3),
        (0.63, -17),
        (0.74, -4),
        (0.86, 2),
    ),
    "subtalar_angle": ((0, 2), (0.15, -4), (0.4, -2), (0.6, 6), (0.8, 2)),
    "mtp_angle": ((0, 8), (0.12, 1), (0.38, 1), (0.55, 22), (0.63, 28), (0.72, 14), (0.88, 12)),
}
RUNNING_LEG: Mapping[str, Knots] = {
    "hip_flexion": ((0, 32), (0.12, 24), (0.34, -7), (0.45, -9), (0.6, 15), (0.78, 44), (0.9, 40)),
    "hip_adduction": ((0, 2), (0.14, 7), (0.34, -1), (0.55, -5), (0.8, -2)),
    "hip_rotation": ((0, 0), (0.3, 2), (0.6, -3), (0.85, -1)),
    "knee_angle": ((0, 17), (0.15, 42), (0.34, 20), (0.5, 66), (0.63, 95), (0.8, 58), (0.93, 18)),
    "ankle_angle": ((0, 4), (0.16, 22), (0.27, 8), (0.36, -22), (0.5, -10), (0.7, 3), (0.88, 6)),
    "subtalar_angle": ((0, 5), (0.15, -6), (0.34, 5), (0.6, 4)),
    "mtp_angle": ((0, 10), (0.1, 2), (0.2, 4), (0.32, 25), (0.4, 22), (0.55, 10), (0.85, 12)),
}
SPRINTING_LEG: Mapping[str, Knots] = {
    "hip_flexion": (
        (0, 36),
        (0.12, 16),
        (0.24, -12),
        (0.33, -14),
        (0.48, 20),
        (0.66, 70),
        (0.78, 76),
        (0.9, 56),
    ),
    "hip_adduction": ((0, 1), (0.12, 5), (0.25, 0), (0.5, -4), (0.8, -2)),
    "hip_rotation": ((0, 0), (0.25, 2), (0.6, -3), (0.85, -1)),
    "knee_angle": (
        (0, 24),
        (0.1, 38),
        (0.22, 24),
        (0.32, 52),
        (0.46, 114),
        (0.56, 124),
        (0.7, 96),
        (0.88, 24),
    ),
    "ankle_angle": ((0, 2), (0.1, 20), (0.17, 6), (0.24, -24), (0.36, -18), (0.55, 0), (0.85, 6)),
    "subtalar_angle": ((0, 4), (0.1, -5), (0.24, 5), (0.6, 3)),
    "mtp_angle": ((0, 12), (0.06, 14), (0.14, 20), (0.23, 32), (0.34, 16), (0.6, 8), (0.88, 10)),
}


def pattern(knots: Knots, phase: Float[np.ndarray, " times"]) -> Float[np.ndarray, " times"]:
    """The periodic curve through the knots (phase, degrees), in radians."""
    x = np.array([knot[0] for knot in knots] + [knots[0][0] + 1])
    y = np.array([knot[1] for knot in knots] + [knots[0][1]])
    return np.radians(CubicSpline(x, y, bc_type="periodic")(np.mod(phase, 1.0)))


def wave(
    phase: Float[np.ndarray, " times"], mean_deg: float, amplitude_deg: float, peak: float = 0.0
) -> np.ndarray:
    """A cosine over the cycle: mean + amplitude · cos 2π(phase − peak), in radians."""
    return np.radians(mean_deg + amplitude_deg * np.cos(2 * np.pi * (phase - peak)))
