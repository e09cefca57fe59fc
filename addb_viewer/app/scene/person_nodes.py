"""The person in the scene: bones, one mesh a body moved by its pose; markers, measured and the model's."""

from collections.abc import Set

import numpy as np
import trimesh
import viser
from jaxtyping import Float, Int, UInt8
from scipy.spatial.transform import Rotation

from addb_viewer.trial_view.palette import BONE, CAUSE_SURFACE, GREY, NO_MODEL, Rgb
from addb_viewer.trial_view.replay import BodyReplay, MarkerReplay

SEE_THROUGH = 0.35  # opacity at which markers inside bones show


class BodyNodes:
    """Owns the bones' nodes below one parent."""

    def __init__(
        self,
        scene: viser.SceneApi,
        parent: str,
        replay: BodyReplay,
        meshes: dict[str, trimesh.Trimesh],
        *,
        color: Rgb = BONE,
        hull: float = 0.0,
    ) -> None:
        """Draw nothing yet.

        Args:
            scene: of the browser.
            parent: name of the node above them.
            replay: where the bodies are.
            meshes: by the bodies' names, in their axes [m].
            color: of all bones.
            hull: by which their surfaces lie farther out [m].
        """
        self.replay, self.color = replay, color
        self.known = replay.known
        self.handles = {
            index: scene.add_mesh_simple(
                f"{parent}/{index}", meshes[name].vertices + hull * meshes[name].vertex_normals,
                meshes[name].faces, color=color, side="front" if hull else "double", cast_shadow=False,
                receive_shadow=False,
            )
            for index, name in enumerate(replay.names)
            if name in meshes
        }  # fmt: skip
        boxes = {index: trimesh.bounds.corners(meshes[replay.names[index]].bounds) for index in self.handles}
        self._corners = np.array(list(boxes.values())).reshape(len(boxes), 8, 3)  # of each bone's box [m]
        self.painted = dict.fromkeys(self.handles, color)
        self.see_through = False

    def extent(self, frame: int) -> Float[np.ndarray, "points 3"]:
        """Corners of boxes around the bones that are seen on a frame [m]."""
        seen = [place for place, index in enumerate(self.handles) if self.known[frame, index]]
        index = np.array(list(self.handles), dtype=int)[seen]
        turned = Rotation.from_quat(self.replay.wxyz[frame, index], scalar_first=True).as_matrix()
        placed = np.einsum("bij,bkj->bki", turned, self._corners[seen])
        return (placed + self.replay.position[frame, index][:, None]).reshape(-1, 3)

    def draw(
        self,
        frame: int,
        *,
        visible: bool,
        see_through: bool,
        marked: Set[int] = frozenset(),
        tints: UInt8[np.ndarray, "bodies 3"] | None = None,
    ) -> None:
        """Show one frame.

        Args:
            frame: of the trial.
            visible: False hides all.
            see_through: so that what is inside shows.
            marked: bodies in the colour of named causes.
            tints: colours of the others; None: all have the same one.
        """
        for index, handle in self.handles.items():
            color = self.color if tints is None else Rgb(*tints[index].tolist())
            color = CAUSE_SURFACE if index in marked else color
            if color != self.painted[index]:
                handle.color = self.painted[index] = color
        if see_through != self.see_through:
            self.see_through = see_through
            for handle in self.handles.values():
                handle.opacity = SEE_THROUGH if see_through else None
        position, wxyz = self.replay.position[frame], self.replay.wxyz[frame]
        known = self.known[frame].tolist()
        for index, handle in self.handles.items():
            shown = visible and known[index]
            handle.visible = shown
            if shown:
                handle.position, handle.wxyz = position[index], wxyz[index]


TRAIL_SEGMENTS = 24  # a marker: enough for a smooth second, few enough for 60 markers at 30 frames a second


# [m] diameters and thicknesses; a motion-capture marker measures 9 to 14 mm
MEASURED = 0.015
MODEL = 0.009
LINE = 0.003
TRAIL = 0.003


class MarkerNodes:
    """Owns the markers' nodes below one parent."""

    def __init__(self, scene: viser.SceneApi, parent: str, replay: MarkerReplay, rate: float) -> None:
        self.rate, self.tracks = rate, replay.tracks
        none = np.zeros((0, 2, 3), dtype=np.float32)
        self.points = scene.add_point_cloud(
            f"{parent}/measured", self.tracks.held[0], self.tracks.colors[0], point_size=MEASURED,
            point_shape="circle", precision="float32",
        )  # fmt: skip
        self.model_points = scene.add_point_cloud(
            f"{parent}/model", none[:, 0], GREY, point_size=MODEL,
            point_shape="circle", precision="float32",
        )  # fmt: skip
        self.lines = scene.add_line_segments(f"{parent}/lines", none, GREY, thickness=LINE)
        self.trails = scene.add_line_segments(f"{parent}/trails", none, NO_MODEL, thickness=TRAIL)

    def draw(self, frame: int, *, with_model: bool, with_lost: bool, trail_seconds: float) -> None:
        """Show one frame; a trail of 0 s is none. Lost markers stay only while the person is in view."""
        t = self.tracks
        drawn = (t.came if with_lost else t.seen)[frame]
        self.points.points = t.held[frame, drawn]
        self.points.colors = t.colors[frame, drawn]
        self.model_points.visible = self.lines.visible = with_model
        if with_model:
            shown = np.isfinite(t.model[frame]).all(axis=1)
            self.model_points.points = t.model[frame, shown]
            both = shown & t.seen[frame]
            self.lines.points = np.stack([t.held[frame, both], t.model[frame, both]], axis=1)
        self.trails.visible = trail_seconds > 0
        if trail_seconds > 0:
            self.trails.points = self._trail(frame, trail_seconds)

    def _trail(self, frame: int, seconds: float) -> Float[np.ndarray, "segments 2 3"]:
        rows = trail_rows(frame, seconds, self.rate)
        path, seen = self.tracks.held[rows], self.tracks.seen[rows]
        segments = np.stack([path[:-1], path[1:]], axis=2)
        return segments[seen[:-1] & seen[1:]]


def trail_rows(frame: int, seconds: float, rate: float) -> Int[np.ndarray, " rows"]:
    """Rows of the recording along a trail that ends at `frame`."""
    first = max(0, frame - round(seconds * rate))
    return np.unique(np.linspace(first, frame, min(TRAIL_SEGMENTS, frame - first) + 1).astype(int))
