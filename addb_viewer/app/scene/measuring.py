"""The measuring tool: two clicks give a distance, three an angle; both follow the cursor."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
import viser
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from addb_viewer.app.scene.camera import UP, Eye
from addb_viewer.app.scene.labels import Label, add_label
from addb_viewer.text.plain_words import in_plain_words
from addb_viewer.trial_view.html_pieces import boxed, table
from addb_viewer.trial_view.palette import BLUE, SKY
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


def marker_words(replay: Replay, frame: int, eye: Eye, place: Float[np.ndarray, "2"]) -> str:
    """Name and error of the marker that is seen at a place of the picture; "" where none is.

    Args:
        replay: the trial.
        frame: that is shown.
        eye: that looks at it, in the ground frame.
        place: [px]
    """
    spot = spot_near(markers_of(replay), frame, eye, place)
    if spot is None:
        return ""
    error = replay.markers.errors[frame, replay.markers.names.index(spot.words)]
    return f"{spot.words} · error {100 * error:.1f} cm" if np.isfinite(error) else spot.words


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


MOST = 3  # clicks; the next one begins anew
THICKNESS, DOT = 0.006, 0.018  # [m]
HOW = "Click markers, joints, corners of plates, or bones: two for a distance, a third for an angle."


class Measuring:
    """What one browser measures in the trial on its screen."""

    def __init__(
        self, scene: viser.SceneApi, parent: str, replay: Replay, meshes: Mapping[str, trimesh.Trimesh]
    ) -> None:
        """Measure nothing yet.

        Args:
            scene: of the browser.
            parent: name of the node above its own.
            replay: the trial.
            meshes: of the bodies, in their axes [m].
        """
        none = np.zeros((0, 3), dtype=np.float32)
        self.replay, self.meshes, self.spots, self.on = replay, meshes, list[Spot](), False
        self.lines = scene.add_line_segments(
            f"{parent}/lines", np.zeros((1, 2, 3)), BLUE, thickness=THICKNESS, visible=False
        )
        self.dots = scene.add_point_cloud(
            f"{parent}/dots", none, SKY, point_size=DOT, point_shape="circle", precision="float32"
        )
        self.label: Label = add_label(scene, f"{parent}/label", "")

    def switch(self, on: bool) -> None:
        """Take clicks from now on, or forget what was measured."""
        if on != self.on:
            self.on, self.spots = on, []

    @cached_property
    def _joints_and_corners(self) -> list[Spot]:
        return joints_and_corners(self.replay)

    def click(self, frame: int, eye: Eye, place: Float[np.ndarray, "2"]) -> bool:
        """Take what is seen at a place of the picture.

        Args:
            frame: that is shown.
            eye: that looks at it, in the ground frame.
            place: [px]

        Returns:
            Whether there is anything.
        """
        spot = spot_near([*markers_of(self.replay), *self._joints_and_corners], frame, eye, place)
        if spot is None and self.replay.bodies is not None:
            spot = spot_on_bone(self.replay.bodies, self.meshes, frame, eye, place)
        if spot is not None:
            self.take(spot)
        return spot is not None

    def take(self, spot: Spot) -> None:
        """One more point; after the last one it begins anew."""
        self.spots = [*([] if len(self.spots) == MOST else self.spots), spot]

    def draw(self, frame: int) -> None:
        """Show one frame."""
        places = [spot.path[frame] for spot in self.spots]
        shown = [spot.path[frame] for spot in self._joints_and_corners] if self.on else []
        dots = np.array([p for p in (*shown, *places) if np.isfinite(p).all()]).reshape(-1, 3)
        if len(dots) or len(self.dots.points):
            self.dots.points = dots.astype(np.float32)
        known = len(places) > 1 and bool(np.isfinite(places).all())
        self.lines.visible = known
        if known:
            self.lines.points = np.stack([places[:-1], places[1:]], axis=1).astype(np.float32)
            text = self._short(frame)
            if self.label.handle.text != text:
                self.label.handle.text = text
        middle = None if not known else np.mean(places[:2], axis=0) if len(places) == 2 else places[1]
        self.label.show(middle)

    def told(self, frame: int) -> str:
        """The figures, as a piece of the page; '' while nothing is measured."""
        if not self.on:
            return ""
        if len(self.spots) < 2:
            chosen = "".join(f"<p>From <b>{html.escape(s.words)}</b>.</p>" for s in self.spots)
            return boxed(f"{HOW}{chosen}")
        names = " – ".join(html.escape(spot.words) for spot in self.spots)
        if len(self.spots) == MOST:
            rows = [("Angle", *_row(np.degrees(angle(*(s.path for s in self.spots))), frame, "°", 1))]
        else:
            way = self.spots[1].path - self.spots[0].path
            rows = [
                ("Distance", *_row(np.linalg.norm(way, axis=1), frame, "m", 3)),
                *(
                    (f"along {axis}", *_row(way[:, k], frame, "m", 3))
                    for k, axis in enumerate(("x", "y (up)", "z"))
                ),
                ("From vertical", *_row(np.degrees(from_vertical(way)), frame, "°", 1)),
            ]
        return boxed(f"<b>{names}</b>{table(rows, ('', 'now', 'in the trial'))}")

    def _short(self, frame: int) -> str:
        paths = [spot.path[frame][None] for spot in self.spots]
        if len(paths) == MOST:
            return f"{np.degrees(angle(*paths))[0]:.1f}°"
        return f"{np.linalg.norm(paths[1] - paths[0]):.3f} m"


def angle(
    a: Float[np.ndarray, "frames 3"], at: Float[np.ndarray, "frames 3"], b: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, " frames"]:
    """Between the ways from a point to two others [rad], 0 to π."""
    one, other = a - at, b - at
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))


def from_vertical(way: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, " frames"]:
    """Of a line, whichever way it is passed [rad], 0 to π/2."""
    return np.arctan2(np.linalg.norm(np.cross(way, UP), axis=1), np.abs(way @ UP))


def _row(values: Float[np.ndarray, " frames"], frame: int, unit: str, digits: int) -> tuple[str, str]:
    """At the cursor; and smallest and largest."""
    space = "" if unit == "°" else "\u00a0"
    known = values[np.isfinite(values)]
    now = f"{values[frame]:.{digits}f}{space}{unit}" if np.isfinite(values[frame]) else "–"
    range_: Sequence[float] = (known.min(), known.max()) if len(known) else ()
    return now, " to ".join(f"{value:.{digits}f}" for value in range_) or "–"
