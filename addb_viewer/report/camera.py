"""Where pictures are seen from: ahead of the person, on their right, so that they walk to the right."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from addb_viewer.trial_view.replay import Replay

FROM_AHEAD = np.radians(62.0)  # about the vertical, from where the person faces
ELEVATION = np.radians(11.0)
FIELD_OF_VIEW = np.radians(28.0)  # vertical
AIR = 1.06  # room around what is to be seen

Points = Float[np.ndarray, "*points 3"]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera; pixels from the top left."""

    eye: Float[np.ndarray, "3"]  # [m] ground frame
    R_camera_ground: Float[np.ndarray, "3 3"]  # rows: right, up, towards the eye
    width: float  # [pixel]
    height: float

    def seen(self, points_ground: Points) -> Points:
        """Pixels right and down, and the depth before the eye [m]."""
        local = (np.asarray(points_ground, dtype=float) - self.eye) @ self.R_camera_ground.T
        depth = -local[..., 2]
        focal = 0.5 * self.height / np.tan(0.5 * FIELD_OF_VIEW)
        safe = np.maximum(depth, 1e-3)
        right = 0.5 * self.width + focal * local[..., 0] / safe
        down = 0.5 * self.height - focal * local[..., 1] / safe
        return np.stack([right, down, depth], axis=-1)


def heading_of(replay: Replay, frame: int) -> float:
    """Where the person faces about the vertical [rad], from x towards z; 0 where nobody knows."""
    forward = None if replay.bodies is None else replay.bodies.forward
    if forward is None or not np.isfinite(forward[frame]).all():
        return 0.0
    return float(np.arctan2(forward[frame, 2], forward[frame, 0]))


def camera_on(points_ground: Points, heading: float, width: float, height: float) -> Camera:
    """A camera that has all points in its picture.

    Args:
        points_ground: what is to be seen [m].
        heading: of the person [rad].
        width: of the picture [pixel].
        height: likewise.
    """
    points = np.asarray(points_ground).reshape(-1, 3)
    turn = heading + FROM_AHEAD
    backward = np.array(
        [np.cos(ELEVATION) * np.cos(turn), np.sin(ELEVATION), np.cos(ELEVATION) * np.sin(turn)]
    )
    right = np.cross([0.0, 1.0, 0.0], backward)
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(backward, right), backward])
    local = points @ R.T
    middle = 0.5 * (local.min(axis=0) + local.max(axis=0))
    tangent = np.tan(0.5 * FIELD_OF_VIEW) * np.array([width / height, 1.0])
    needed = np.abs(local[:, :2] - middle[:2]) / tangent + (local[:, 2] - middle[2])[:, None]
    distance = AIR * float(needed.max())
    return Camera((middle + np.array([0.0, 0.0, distance])) @ R, R, width, height)
