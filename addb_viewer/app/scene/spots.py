"""What a click in the scene is about: a marker, a joint's centre, a plate's corner, or a point on a bone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from addb_viewer.app.scene.camera import Eye
from addb_viewer.text.plain_words import in_plain_words
from addb_viewer.trial_view.replay import BodyReplay, PlateReplay, Replay

NEAR_PX = 12.0  # from a click: a marker of 15 mm fills about 6 where the person fills the picture
SIDES = {"_r": "right", "_l": "left"}


@dataclass(frozen=True, eq=False)
class Spot:
    """One point and its way through the trial."""

    words: str
    path: Float[np.ndarray, "frames 3"]  # [m] NaN where it is not known


def markers_of(replay: Replay) -> list[Spot]:
    """As they were measured."""
    paths = replay.markers.measured
    return [Spot(name, paths[:, i]) for i, name in enumerate(replay.markers.names)]


def joints_and_corners(replay: Replay) -> list[Spot]:
    """The centres of all joints but the root's, and the corners of plates."""
    joints = [] if replay.bodies is None else _joints(replay.bodies)
    corners = [
        Spot(f"{plate.name}, corner {k + 1}", np.tile(corner, (replay.frames, 1)))
        for plate in replay.plates
        for k, corner in enumerate(_corners(plate))
    ]
    return [*joints, *corners]


def _joints(bodies: BodyReplay) -> list[Spot]:
    return [
        Spot(joint_words(joint.name), bodies.point_ground(body, joint.center_body))
        for body, joint in bodies.joints.items()
    ]


def joint_words(name: str) -> str:
    """As people say it: "right knee" for walker_knee_r."""
    side = SIDES.get(name[-2:], "")
    bare = name.removesuffix(name[-2:]) if side else name
    return f"{side} {bare.removeprefix('walker_').replace('_', ' ')}".strip()


def spot_near(spots: Sequence[Spot], frame: int, eye: Eye, place: Float[np.ndarray, "2"]) -> Spot | None:
    """The one that is seen nearest to a place of the picture; None where none is near.

    Args:
        spots: to choose from.
        frame: that is shown.
        eye: that looks at it, in the ground frame.
        place: [px]
    """
    known = [spot for spot in spots if np.isfinite(spot.path[frame]).all()]
    if not known:
        return None
    seen, depths = eye.project(np.stack([spot.path[frame] for spot in known]))
    away = np.where(depths > 0, np.linalg.norm(seen - place, axis=1), np.inf)
    return known[int(away.argmin())] if away.min() <= NEAR_PX else None


def spot_on_bone(
    bodies: BodyReplay,
    meshes: Mapping[str, trimesh.Trimesh],
    frame: int,
    eye: Eye,
    place: Float[np.ndarray, "2"],
) -> Spot | None:
    """The point of a bone's surface that is seen at a place of the picture; None where no bone is.

    Args:
        bodies: of the trial.
        meshes: of the bodies, in their axes [m].
        frame: that is shown.
        eye: that looks at it, in the ground frame.
        place: [px]
    """
    ray = eye.point_at(place, 1.0) - eye.position
    nearest, found = np.inf, None
    for body, name in enumerate(bodies.names):
        wxyz, origin = bodies.wxyz[frame, body], bodies.position[frame, body]
        if name not in meshes or not (np.isfinite(wxyz).all() and np.isfinite(origin).all()):
            continue
        R_ground_body = Rotation.from_quat(wxyz[[1, 2, 3, 0]]).as_matrix()
        start_body, ray_body = R_ground_body.T @ (eye.position - origin), R_ground_body.T @ ray
        depth = first_hit(np.asarray(meshes[name].triangles), start_body, ray_body)
        if depth < nearest:
            nearest = depth
            words = f"{in_plain_words(name)}, a point on the bone"
            found = Spot(words, bodies.point_ground(body, start_body + depth * ray_body))
    return found


def first_hit(
    triangles: Float[np.ndarray, "faces 3 3"], start: Float[np.ndarray, "3"], ray: Float[np.ndarray, "3"]
) -> float:
    """How many times the ray it is to the first triangle ahead; infinite where it meets none.

    Möller & Trumbore 1997 (10.1080/10867651.1997.10487468).
    """
    a, side, other = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = np.cross(ray, other)
    volume = (side * across).sum(axis=1)
    flat = np.abs(volume) < 1e-15
    scale = 1.0 / np.where(flat, 1.0, volume)
    from_a = start - a
    u = (from_a * across).sum(axis=1) * scale
    turned = np.cross(from_a, side)
    v = (turned @ ray) * scale
    depth = (other * turned).sum(axis=1) * scale
    hit = ~flat & (u >= 0) & (v >= 0) & (u + v <= 1) & (depth > 0)
    return float(depth[hit].min(initial=np.inf))


def _corners(plate: PlateReplay) -> Float[np.ndarray, "corners 3"]:
    known = plate.corners is not None and np.isfinite(plate.corners).all()
    return plate.corners if known and plate.corners is not None else np.zeros((0, 3))
