"""Where people look from: three quarters, front, side and top of the person."""

from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float

UP = np.array([0.0, 1.0, 0.0])
FIELD_OF_VIEW = np.radians(40.0)  # vertical; wider bends limbs at the picture's edge
DISTANCE = 3.3  # [m] a person fills the height


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


def look(
    server: viser.ViserServer, name: str, heading: Float[np.ndarray, "3"], center: Float[np.ndarray, "3"]
) -> None:
    """Turn every browser's camera to one of the views, and the first sight of browsers that come later."""
    position = eye(VIEWS[name], heading, center)
    server.initial_camera.fov = FIELD_OF_VIEW
    server.initial_camera.up = UP
    server.initial_camera.position = position
    server.initial_camera.look_at = center
    for client in server.get_clients().values():
        with client.atomic():
            client.camera.up_direction = UP
            client.camera.position = position
            client.camera.look_at = center
