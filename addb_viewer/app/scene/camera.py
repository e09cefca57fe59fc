"""Where people look from: three quarters, front, side and top of the person."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

UP = np.array([0.0, 1.0, 0.0])
FIELD_OF_VIEW = np.radians(40.0)  # vertical; wider bends limbs at the picture's edge
DISTANCE = 3.3  # [m] a person fills the height
MARGIN = 0.1  # of the picture, at each edge, around what is fitted into it
RESTS_S = 0.25  # after its last word the camera stands still; while it moves it speaks every 0.05 s


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


@dataclass(frozen=True)
class Eye:
    """A camera: what it sees where."""

    position: Float[np.ndarray, "3"]  # [m]
    R_ground_eye: Float[np.ndarray, "3 3"]  # axes right, down and ahead
    focal: float  # [px]
    size: Float[np.ndarray, "2"]  # width and height of the picture [px]

    def project(
        self, points: Float[np.ndarray, "points 3"]
    ) -> tuple[Float[np.ndarray, "points 2"], Float[np.ndarray, " points"]]:
        """Where points are in the picture, from its upper left [px], and how far ahead [m]."""
        seen = (points - self.position) @ self.R_ground_eye
        depth = seen[:, 2]
        ahead = np.where(depth > 0, depth, 1.0)
        return 0.5 * self.size + self.focal * seen[:, :2] / ahead[:, None], depth

    def sees(self, points: Float[np.ndarray, "points 3"]) -> Bool[np.ndarray, " points"]:
        """Whether they are in the picture."""
        places, depth = self.project(points)
        return (depth > 0) & ((places >= 0) & (places <= self.size)).all(axis=1)

    def point_at(self, place: Float[np.ndarray, "2"], depth: float) -> Float[np.ndarray, "3"]:
        """The point that is seen there, so far ahead [m]: the inverse of `project`."""
        across = (place - 0.5 * self.size) / self.focal * depth
        return self.position + self.R_ground_eye @ np.array([*across, depth])


def eye_of(camera: viser.CameraHandle, size: tuple[float, float] | None = None) -> Eye:
    """The one of a browser.

    Args:
        camera: of the browser.
        size: of the picture [px of the page]; None: as the camera says it, in pixels of the screen.
    """
    width, height = size or (camera.image_width, camera.image_height)
    R = Rotation.from_quat(np.asarray(camera.wxyz)[[1, 2, 3, 0]]).as_matrix()
    focal = 0.5 * height / np.tan(0.5 * camera.fov)
    return Eye(np.asarray(camera.position, dtype=float), R, focal, np.array([width, height], dtype=float))


def when_at_rest(client: viser.ClientHandle, then: Callable[[], None]) -> None:
    """Call something, which returns at once, whenever the camera has moved and stands still again."""
    waiting: list[asyncio.TimerHandle] = []

    async def moved(_: viser.CameraHandle) -> None:
        for one in waiting:
            one.cancel()
        waiting[:] = [asyncio.get_running_loop().call_later(RESTS_S, then)]

    client.camera.on_update(moved)


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
