"""Average speed of a stretch of walking or running, over a floor and over a belt."""

import numpy as np
from jaxtyping import Bool, Float

from solver.common.runs import runs
from solver.gait.settings import GAIT, GaitSettings

FEWEST_FRAMES = 3  # amid a stance: fewer tell no speed


def overground_speed(com_velocity: Float[np.ndarray, "frames 3"]) -> float | None:
    """Mean over all frames of |v| of the centre of mass, in three dimensions [m/s]; None without a frame.

    Args:
        com_velocity: of the motion of the markers alone [m/s].
    """
    return float(np.linalg.norm(com_velocity, axis=1).mean()) if len(com_velocity) else None


def treadmill_speed(
    points_ground: Float[np.ndarray, "frames feet points 3"],
    in_contact: Bool[np.ndarray, "frames feet"],
    rate: float,
    settings: GaitSettings = GAIT,
) -> float | None:
    """Mean over stances, of both legs, of how fast a flat foot is carried by the belt [m/s].

    The dataset paper takes the ankle over the whole of each contact. Early and late in it the foot turns
    about heel or toes, and the ankle, a hand's breadth above them, goes forward over the belt: speeds come
    out low. So only the part counts in which the foot is flat, and there whichever of heel and toes is
    carried farther: a foot that turns moves one of them over the belt, never the one it turns about.
    Stances that are cut by the first or the last frame do not count; None where there is no other.

    Args:
        points_ground: low points of each foot, as heel and ball [m].
        in_contact: which foot is on the ground.
        rate: [Hz].
        settings: which part of a stance the foot is flat in.
    """
    found = []
    for foot in range(in_contact.shape[1]):
        for start, end in runs(in_contact[:, foot]):
            if start == 0 or end == len(in_contact):
                continue
            first = start + int(np.ceil(settings.flat_from * (end - start)))
            last = start + int(np.floor(settings.flat_to * (end - start)))
            if last - first + 1 >= FEWEST_FRAMES:
                ways = np.linalg.norm(points_ground[last, foot] - points_ground[first, foot], axis=1)
                found.append(float(ways.max()) * rate / (last - first))
    return float(np.mean(found)) if found else None
