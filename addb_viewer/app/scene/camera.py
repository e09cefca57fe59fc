"""Where people look from: three quarters, front, side and top of the person."""

from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float

UP = np.array([0.0, 1.0, 0.0])
FIELD_OF_VIEW = np.radians(40.0)  # vertical; wider bends limbs at the picture's edge
DISTANCE = 3.3  # [m] a person fills the height
MARGIN = 0.1  # of the picture, at each edge, around what is fitted into it


@dataclass(frozen=True)
class View:
    """Direction from the person to the camera: shares of the way they face, of their right, and of up."""

    forward: float
    right: float
    up: float


VIEWS = {
    "Front": View(1.0, 0.0, 0.08),
    "Side": View(0.0, 1.0, 0.08),
    "Top": View(-0.01, 0.0, 1.0),  # not straight down, where up would have no direction
    "Reset": View(0.62, 0.75, 0.22),
}


def eye(
    view: View, heading: Float[np.ndarray, "3"], center: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"]:
    """Where the camera stands.

    Args:
        view: direction.
        heading: horizontal unit vector to where the person faces.
        center: what the camera looks at [m].
    """
    direction = view.forward * heading + view.right * np.cross(heading, UP) + view.up * UP
    return center + DISTANCE * direction / np.linalg.norm(direction)


def distance_to_see(
    points: Float[np.ndarray, "points 3"],
    center: Float[np.ndarray, "3"],
    back: Float[np.ndarray, "3"],
    fov: float,
    aspect: float,
) -> float:
    """How far from the centre a camera sees all points, with a margin [m].

    Args:
        points: to be seen [m].
        center: what the camera looks at [m].
        back: unit vector from the centre to the camera.
        fov: vertical field of view [rad].
        aspect: width of the picture in units of its height.
    """
    right = np.cross(UP, back)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([1.0, 0.0, 0.0])
    above = np.cross(back, right)
    seen = points - center
    half = np.tan(fov / 2) * (1 - MARGIN)
    needed = np.maximum(np.abs(seen @ above) / half, np.abs(seen @ right) / (half * aspect)) + seen @ back
    return float(needed.max())


def fit(client: viser.ClientHandle, points: Float[np.ndarray, "points 3"]) -> bool:
    """Bring all points into one browser's picture, seen from the present side.

    Args:
        client: the browser.
        points: of a person [m].

    Returns:
        Whether there is somebody: two points at least.
    """
    if len(points) < 2:
        return False
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    camera = client.camera
    back = np.asarray(camera.position) - np.asarray(camera.look_at)
    back = back / np.linalg.norm(back)
    aspect = camera.image_width / max(camera.image_height, 1)
    distance = distance_to_see(points, center, back, FIELD_OF_VIEW, aspect)
    with client.atomic():
        camera.fov, camera.up_direction = FIELD_OF_VIEW, UP
        camera.position, camera.look_at = center + distance * back, center
    return True


def first_sight(server: viser.ViserServer) -> None:
    """What every browser sees before its trial is there: somebody at the origin who faces along x.

    Up is said here, before any browser comes: the page turns its camera when it hears of it.
    """
    center = np.array([0.0, 0.95, 0.0])
    server.scene.set_up_direction("+y")
    server.initial_camera.fov = FIELD_OF_VIEW
    server.initial_camera.up = UP
    server.initial_camera.position = eye(VIEWS["Reset"], np.array([1.0, 0.0, 0.0]), center)
    server.initial_camera.look_at = center


def look(
    client: viser.ClientHandle, name: str, heading: Float[np.ndarray, "3"], center: Float[np.ndarray, "3"]
) -> None:
    """Turn one browser's camera to one of the views."""
    with client.atomic():
        client.camera.fov = FIELD_OF_VIEW
        client.camera.up_direction = UP
        client.camera.position = eye(VIEWS[name], heading, center)
        client.camera.look_at = center
