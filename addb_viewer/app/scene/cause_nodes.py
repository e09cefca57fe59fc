"""The causes of a diagnosis in the scene: arrows, balls, outlines, marked markers, and a label for each."""

from collections.abc import Sequence

import numpy as np
import viser
from jaxtyping import Bool, Float

from addb_viewer.app.scene.labels import Label, add_label
from addb_viewer.trial_view.cause_pictures import Picture
from addb_viewer.trial_view.palette import CAUSE, CAUSE_SURFACE
from addb_viewer.trial_view.replay import MarkerReplay

# [m] how causes are drawn
SHAFT_RADIUS = 0.024  # thicker than bones, inside which forces act
HEAD_RADIUS = 0.060
HEAD_LENGTH = 0.12
OUTLINE = 0.016
BAND = 0.012
ANCHOR = 0.05
MARKER = 0.028
OVER_HEAD = 1.95  # of labels without a place, above the ground
LINE_HEIGHT = 0.09  # from one label to the next
TEXT_WIDTH = 0.8  # nearer ones would overlap
SHORTEST = 0.04  # arrow: 10 N
BESIDE = 0.06  # from a place to its label


class CauseNodes:
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

    @property
    def labels(self) -> list[Label]:
        """Of all causes."""
        return [cause.label for cause in self.one_by_one]

    def draw(self, frame: int, *, visible: bool) -> None:
        """Show one frame; labels without a place stand above the person, none over another."""
        free = self.path[frame] + np.array([0.0, OVER_HEAD, 0.0])
        taken: list[Float[np.ndarray, "3"]] = []
        for cause in self.one_by_one:
            wanted = cause.draw(frame, free, visible=visible)
            if wanted is not None:
                taken.append(_beside_others(wanted, taken))
            cause.label.show(None if wanted is None else taken[-1])

    def marked_bodies(self, frame: int, *, visible: bool) -> set[int]:
        """Indices of the segments that a cause acts on."""
        return {body for body, acts in self.marked.items() if visible and acts[frame]}


class _Cause:
    """One cause."""

    def __init__(self, scene: viser.SceneApi, name: str, picture: Picture, markers: MarkerReplay) -> None:
        self.picture, self.measured = picture, markers.measured
        self.label = add_label(scene, f"{name}/label", picture.label)
        self.arrow = _arrow(scene, f"{name}/force") if picture.force is not None else None
        self.ball = _ball(scene, f"{name}/ball", picture.radius, 0.75) if picture.radius else None
        self.band = _lines(scene, f"{name}/band", _NONE, BAND) if picture.anchor is not None else None
        self.marks = [_ball(scene, f"{name}/marker{m}", MARKER, 0.45) for m in picture.markers]
        self.still: list[viser.SceneNodeHandle] = []
        if picture.outline is not None:
            self.still.append(_lines(scene, f"{name}/outline", picture.outline, OUTLINE))
        if picture.anchor is not None:
            anchor = _ball(scene, f"{name}/anchor", ANCHOR, 1.0)
            anchor.position = picture.anchor
            self.still.append(anchor)

    def draw(
        self, frame: int, free: Float[np.ndarray, "3"], *, visible: bool
    ) -> Float[np.ndarray, "3"] | None:
        """Show one frame.

        Args:
            frame: of the trial.
            free: where labels stand that have no place [m].
            visible: False hides it.

        Returns:
            Where the label should stand [m]; None while there is none.
        """
        picture = self.picture
        acts = visible and bool(picture.acts[frame])
        for node in self.still:
            node.visible = acts
        for marker, mark in zip(picture.markers, self.marks, strict=True):
            _put(mark, self.measured[frame, marker], acts)
        place = None if picture.place is None else picture.place[frame]
        named = acts and (place is None or bool(np.isfinite(place).all()))
        tip = free if place is None else self._draw_at(place, frame, named)
        return tip if named else None

    def _draw_at(self, place: Float[np.ndarray, "3"], frame: int, acts: bool) -> Float[np.ndarray, "3"]:
        """What hangs at the place; where its label should stand."""
        picture, tip = self.picture, place
        if self.arrow is not None and picture.force is not None:
            along = picture.metres_per_newton * picture.force[frame]
            length = float(np.linalg.norm(along))  # NaN where the force is not known
            self.arrow.visible = acts and length >= SHORTEST
            if self.arrow.visible:
                tip = place + along
                self.arrow.head_length = min(HEAD_LENGTH, 0.6 * length)
                self.arrow.points = np.stack([place, tip])[None].astype(np.float32)
        if self.ball is not None:
            _put(self.ball, place, acts)
        if self.band is not None and picture.anchor is not None:
            self.band.visible = acts
            if acts:
                self.band.points = np.stack([place, picture.anchor])[None].astype(np.float32)
        return np.asarray(tip + np.array([0.0, BESIDE, 0.0]))


def _beside_others(
    wanted: Float[np.ndarray, "3"], taken: Sequence[Float[np.ndarray, "3"]]
) -> Float[np.ndarray, "3"]:
    """Higher by as many lines as it takes not to lie over other labels."""
    place = wanted.copy()

    def overlaps(other: Float[np.ndarray, "3"]) -> bool:
        across, up = np.linalg.norm((place - other)[[0, 2]]), abs(place[1] - other[1])
        return bool(across < TEXT_WIDTH and up < 0.99 * LINE_HEIGHT)

    while any(overlaps(other) for other in taken):
        place[1] += LINE_HEIGHT
    return place


_NONE = np.array([[[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]])


def _put(node: viser.SceneNodeHandle, place: Float[np.ndarray, "3"], wanted: bool) -> None:
    node.visible = wanted and bool(np.isfinite(place).all())
    if node.visible:
        node.position = place


def _arrow(scene: viser.SceneApi, name: str) -> viser.ArrowsHandle:
    return scene.add_arrows(
        name, _NONE, np.array(CAUSE.linear, dtype=np.uint8), shaft_radius=SHAFT_RADIUS,
        head_radius=HEAD_RADIUS, head_length=HEAD_LENGTH, visible=False,
    )  # fmt: skip


def _lines(
    scene: viser.SceneApi, name: str, segments: Float[np.ndarray, "segments 2 3"], thickness: float
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(name, segments, CAUSE, thickness=thickness, visible=False)


def _ball(scene: viser.SceneApi, name: str, radius: float, opacity: float) -> viser.IcosphereHandle:
    return scene.add_icosphere(
        name, radius, CAUSE_SURFACE, opacity=opacity, cast_shadow=False, receive_shadow=False, visible=False
    )
