"""The measuring tool: two clicks give a distance, three an angle; both follow the cursor."""

import html
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
import trimesh
import viser
from jaxtyping import Float

from addb_viewer.app.scene.camera import UP, Eye
from addb_viewer.app.scene.labels import Label, add_label
from addb_viewer.app.scene.spots import Spot, joints_and_corners, markers_of, spot_near, spot_on_bone
from addb_viewer.trial_view.html_pieces import boxed, table
from addb_viewer.trial_view.palette import BLUE, SKY
from addb_viewer.trial_view.replay import Replay

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
