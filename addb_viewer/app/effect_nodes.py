"""The causes of a diagnosis in the scene: arrows, balls, outlines, marked markers, and a label for each."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Bool, Float

from addb_viewer.app.effect_pictures import Picture
from addb_viewer.app.palette import CAUSE, CAUSE_SURFACE
from addb_viewer.app.replay import MarkerReplay


@dataclass(frozen=True)
class CauseSizes:
    """How causes are drawn [m]."""

    shaft_radius: float = 0.024  # thicker than bones, inside which forces act
    head_radius: float = 0.060
    head_length: float = 0.12
    outline: float = 0.016
    band: float = 0.012
    anchor: float = 0.05
    marker: float = 0.028
    text: float = 0.05
    over_head: float = 1.95  # of labels without a place, above the ground
    line_height: float = 0.09  # between them
    beside: float = 0.06  # from a place to its label


class EffectNodes:
    """Owns the nodes of all causes below one parent."""

    def __init__(
        self,
        scene: viser.SceneApi,
        parent: str,
        pictures: Sequence[Picture],
        path: Float[np.ndarray, "frames 3"],
        markers: MarkerReplay,
    ) -> None:
        self.path = path
        self.one_by_one = [
            _Cause(scene, f"{parent}/{i}", picture, markers) for i, picture in enumerate(pictures)
        ]
        self.marked: dict[int, Bool[np.ndarray, " frames"]] = {}
        for picture in pictures:
            for body in picture.bodies:
                self.marked[body] = self.marked.get(body, np.zeros(len(path), dtype=bool)) | picture.acts

    def draw(self, frame: int, *, visible: bool) -> None:
        """Show one frame; labels without a place stand one below the other above the person."""
        line = 0
        for cause in self.one_by_one:
            free = self.path[frame] + [0.0, CauseSizes().over_head + line * CauseSizes().line_height, 0.0]
            line += cause.draw(frame, free, visible=visible)

    def marked_bodies(self, frame: int, *, visible: bool) -> set[int]:
        """Indices of the segments that a cause acts on."""
        return {body for body, acts in self.marked.items() if visible and acts[frame]}


class _Cause:
    """One cause."""

    def __init__(self, scene: viser.SceneApi, name: str, picture: Picture, markers: MarkerReplay) -> None:
        self.picture, self.measured, sizes = picture, markers.measured, CauseSizes()
        self.label = scene.add_label(
            f"{name}/label", picture.label, visible=False, font_size_mode="scene",
            font_scene_height=sizes.text, anchor="bottom-center",
        )  # fmt: skip
        self.arrow = _arrow(scene, f"{name}/force") if picture.force is not None else None
        self.ball = _ball(scene, f"{name}/ball", picture.radius, 0.75) if picture.radius else None
        self.band = _lines(scene, f"{name}/band", _NONE, sizes.band) if picture.anchor is not None else None
        self.marks = [_ball(scene, f"{name}/marker{m}", sizes.marker, 0.45) for m in picture.markers]
        self.still: list[viser.SceneNodeHandle] = []
        if picture.outline is not None:
            self.still.append(_lines(scene, f"{name}/outline", picture.outline, sizes.outline))
        if picture.anchor is not None:
            anchor = _ball(scene, f"{name}/anchor", sizes.anchor, 1.0)
            anchor.position = picture.anchor
            self.still.append(anchor)

    def draw(self, frame: int, free: Float[np.ndarray, "3"], *, visible: bool) -> int:
        """Show one frame.

        Returns:
            Lines of text taken above the person: 1 where the label has no place.
        """
        picture = self.picture
        acts = visible and bool(picture.acts[frame])
        for node in self.still:
            node.visible = acts
        for marker, mark in zip(picture.markers, self.marks, strict=True):
            _put(mark, self.measured[frame, marker], acts)
        if picture.place is None:
            self.label.visible = acts
            self.label.position = free
            return int(acts)
        self._draw_at(picture.place[frame], frame, acts)
        return 0

    def _draw_at(self, place: Float[np.ndarray, "3"], frame: int, acts: bool) -> None:
        picture, tip = self.picture, place
        acts = acts and bool(np.isfinite(place).all())
        if self.arrow is not None and picture.force is not None:
            force = picture.force[frame]
            self.arrow.visible = acts and bool(np.isfinite(force).all() and force.any())
            if self.arrow.visible:
                tip = place + picture.metres_per_newton * force
                self.arrow.points = np.stack([place, tip])[None].astype(np.float32)
        if self.ball is not None:
            _put(self.ball, place, acts)
        if self.band is not None and picture.anchor is not None:
            self.band.visible = acts
            if acts:
                self.band.points = np.stack([place, picture.anchor])[None].astype(np.float32)
        self.label.visible = acts
        if acts:
            self.label.position = tip + np.array([0.0, CauseSizes().beside, 0.0])


_NONE = np.array([[[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]])


def _put(node: viser.SceneNodeHandle, place: Float[np.ndarray, "3"], wanted: bool) -> None:
    node.visible = wanted and bool(np.isfinite(place).all())
    if node.visible:
        node.position = place


def _arrow(scene: viser.SceneApi, name: str) -> viser.ArrowsHandle:
    sizes = CauseSizes()
    return scene.add_arrows(
        name, _NONE, np.array(CAUSE.linear, dtype=np.uint8), shaft_radius=sizes.shaft_radius,
        head_radius=sizes.head_radius, head_length=sizes.head_length, visible=False,
    )  # fmt: skip


def _lines(
    scene: viser.SceneApi, name: str, segments: Float[np.ndarray, "segments 2 3"], thickness: float
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(name, segments, CAUSE, thickness=thickness, visible=False)


def _ball(scene: viser.SceneApi, name: str, radius: float, opacity: float) -> viser.IcosphereHandle:
    return scene.add_icosphere(
        name, radius, CAUSE_SURFACE, opacity=opacity, cast_shadow=False, receive_shadow=False, visible=False
    )
