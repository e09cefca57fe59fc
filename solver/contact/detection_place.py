"""Under which feet a missing force presses: the moments it leaves unbalanced tell where it acts."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float

from solver.contact.detection_balance import UP
from solver.contact.detection_settings import DetectionSettings
from solver.contact.detection_shares import Explained, WrenchBalance
from solver.contact.sole import Sole

Feet = tuple[int, ...]


def place_costs(
    slow: WrenchBalance,
    explained: Explained,
    outlines: Sequence[Sole],
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
    settings: DetectionSettings,
) -> dict[Feet, Float[np.ndarray, " frames"]]:
    """For every set of feet that may miss force: minus the log likelihood of the place where it presses.

    Half the squared distance from the soles, in standard deviations: the smaller the missing force, the less
    its place is known. Between two feet is as good as under one. Nothing missing: no cost.

    Args:
        slow: required and measured wrenches.
        explained: what of their difference is known.
        outlines: of the soles.
        poses: orientations and origins of all bodies.
        settings: thresholds.
    """
    missing = slow.missing(explained)
    spread = np.hypot(
        settings.point_noise_m,
        explained.moment_noise
        * slow.body.moment_noise
        / np.maximum(missing[:, UP], settings.least_pressing_N),
    )
    pressing = missing[:, UP] > settings.least_pressing_N
    points, offsets = [], []
    for sole in outlines:
        corners = sole.corners_ground(*poses)
        ground = corners[..., UP].min(axis=1)
        point = slow.body.pressed_point(missing, ground)
        points.append(np.insert(point, UP, ground, axis=1))
        offsets.append(corners[..., [0, 2]].mean(axis=1))
    far = [s.distance(*poses, p) for s, p in zip(outlines, points, strict=True)]
    costs = {}
    for count in range(1, len(outlines) + 1):
        for feet in combinations(range(len(outlines)), count):
            distance = np.min([far[f] for f in feet], axis=0)
            for a, b in combinations(feet, 2):
                between = _from_segment(points[a][:, [0, 2]], offsets[a], offsets[b])
                distance = np.minimum(distance, np.maximum(0.0, between - settings.half_sole_m))
            cost = np.minimum(0.5 * (distance / spread) ** 2, settings.strongest_place)
            costs[feet] = np.where(pressing, cost, 0.0)
    return costs


def _from_segment(
    point: Float[np.ndarray, "frames 2"], a: Float[np.ndarray, "frames 2"], b: Float[np.ndarray, "frames 2"]
) -> Float[np.ndarray, " frames"]:
    along = b - a
    length = np.maximum(np.sum(along**2, axis=1), 1e-9)
    share = np.clip(np.sum((point - a) * along, axis=1) / length, 0.0, 1.0)
    return np.linalg.norm(point - a - share[:, None] * along, axis=1)
