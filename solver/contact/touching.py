"""Which feet touch the ground, from their motion: low, and moving with the surface."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.contact.settings import ContactSettings


def touching(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    standing: Bool[np.ndarray, "frames feet"],
    rate: float,
    settings: ContactSettings,
) -> Bool[np.ndarray, "frames feet"]:
    """Whether any corner of a foot's sole is as low as when it is loaded, and does not slide.

    The loaded frames tell how high each foot's lowest corner then is, so the sole's depth and the plates'
    height need not be known to the centimetre, and how fast the surface moves (a treadmill's belt). Where
    there are too few, the foot's own low frames tell.

    Args:
        corners_ground: of each foot's sole [m].
        standing: frames on which a plate certainly carries the foot.
        rate: [Hz].
        settings: thresholds.
    """
    frames = standing.shape[0]
    if frames < 2 or not corners_ground:
        return standing.copy()
    lowest = np.column_stack([corners[..., 1].min(axis=1) for corners in corners_ground])
    velocities = [np.gradient(corners, 1.0 / rate, axis=0)[..., [0, 2]] for corners in corners_ground]
    enough = settings.shortest_standing_s * rate
    reach = [
        _level(lowest, standing, f, enough) + settings.touch_height_m for f in range(len(corners_ground))
    ]
    certain = standing if standing.sum() >= enough else lowest <= reach
    surface = _surface_velocity(corners_ground, velocities, certain)
    touches = np.zeros_like(standing)
    for f, (corners, velocity) in enumerate(zip(corners_ground, velocities, strict=True)):
        slow = np.linalg.norm(velocity - surface, axis=2) <= settings.touch_speed_m_s
        touches[:, f] = ((corners[..., 1] <= reach[f]) & slow).any(axis=1)
    return touches


def _level(
    lowest: Float[np.ndarray, "frames feet"],
    standing: Bool[np.ndarray, "frames feet"],
    foot: int,
    enough: float,
) -> float:
    """Height of a foot's lowest corner while loaded [m]: its own, else any foot's, else as low as it gets."""
    if standing[:, foot].sum() >= enough:
        return float(np.median(lowest[standing[:, foot], foot]))
    if standing.sum() >= enough:
        return float(np.median(lowest[standing]))
    return float(np.percentile(lowest[:, foot], 5))


def _surface_velocity(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    velocities: Sequence[Float[np.ndarray, "frames corners 2"]],
    standing: Bool[np.ndarray, "frames feet"],
) -> Float[np.ndarray, "2"]:
    """Median velocity of the lowest corners of standing feet [m/s]."""
    frames = np.arange(len(standing))
    samples = [
        velocity[frames, corners[..., 1].argmin(axis=1)][standing[:, f]]
        for f, (corners, velocity) in enumerate(zip(corners_ground, velocities, strict=True))
    ]
    return np.median(np.concatenate(samples), axis=0)
