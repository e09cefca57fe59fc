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
