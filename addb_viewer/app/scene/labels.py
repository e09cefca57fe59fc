"""Labels in the scene: equally large, and, once the picture rests, inside it and none over another."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float

from addb_viewer.app.scene.camera import Eye

SCALE = 1.1  # of viser's letters, whose em is 12 pixels
EM_PX = 12.0 * SCALE
LINE_PX = 1.7 * EM_PX  # of a label with its border
LETTER_PX = 0.56 * EM_PX  # mean width of a letter
BORDER_PX = 0.6 * EM_PX  # left and right together
EDGE_PX = 6.0  # from the picture's edge
BESIDE_PX = 5.0  # between a place and its label
APART_PX = 2.0
ROWS, COLUMNS = 6, 2  # how far a label may go: label heights up and down, half widths to the sides

Box = tuple[float, float, float, float]  # left, upper, right, lower [px]


@dataclass(eq=False)
class Label:
    """One label. It stands beside its place, and keeps its way from there while the place moves."""

    handle: viser.LabelHandle
    side: int  # 1 above its place, −1 below it
    of: (
        Float[np.ndarray, "points 3"] | None
    )  # [m] of which one has to be in the picture; None: it always shows
    place: Float[np.ndarray, "3"]  # [m]
    shift: Float[np.ndarray, "3"]  # [m]
    on: bool  # whether it shows where there is something to be named in the picture

    @property
    def size(self) -> Float[np.ndarray, "2"]:
        """Width and height [px]."""
        return np.array([LETTER_PX * len(self.handle.text) + BORDER_PX, LINE_PX])

    def show(self, place: Float[np.ndarray, "3"] | None) -> None:
        """Stand at a place [m]; None hides it."""
        self.on = self.handle.visible = place is not None
        if place is not None:
            self.place = place
            self._put(self.shift)

    def _put(self, shift: Float[np.ndarray, "3"]) -> None:
        self.shift = shift
        position = self.place + shift
        if not np.allclose(position, self.handle.position, atol=1e-5):
            self.handle.position = position

    def stand_at(self, position: Float[np.ndarray, "3"]) -> None:
        """Stand beside its place [m]."""
        self._put(position - self.place)


def add_label(
    scene: viser.SceneApi,
    name: str,
    text: str,
    place: Float[np.ndarray, "3"] | None = None,
    *,
    side: int = 1,
    of: Float[np.ndarray, "points 3"] | None = None,
) -> Label:
    """A label of the scene; without a place it is hidden.

    Args:
        scene: of the browser.
        name: of the node.
        text: one line.
        place: [m]
        side: 1 above the place, −1 below it.
        of: what it names [m]: while none of these points is in the picture, the label is neither; None: it
            always comes into the picture.
    """
    start = np.zeros(3) if place is None else place
    handle = scene.add_label(
        name, text, position=start, visible=place is not None, font_size_mode="screen",
        font_screen_scale=SCALE, anchor="center-center",
    )  # fmt: skip
    return Label(handle, side, of, start, np.zeros(3), place is not None)


def settle(labels: Iterable[Label], eye: Eye, offset: Float[np.ndarray, "3"]) -> None:
    """Move the labels that are shown to where they are whole and none lies over another.

    Args:
        labels: the most important ones first.
        eye: that looks at them.
        offset: of their parent in the ground frame [m].
    """
    shown = [label for label in labels if label.on]
    if not shown:
        return
    places, depths = eye.project(np.stack([label.place for label in shown]) + offset)
    taken: list[Box] = []
    for label, place, depth in zip(shown, places, depths, strict=True):
        seen = depth > 0 and (label.of is None or bool(eye.sees(label.of + offset).any()))
        label.handle.visible = seen
        if not seen:
            continue
        wanted = place - [0.0, label.side * (BESIDE_PX + 0.5 * LINE_PX)]
        centre = free_place(wanted, label.size, taken, eye.size)
        taken.append(_box(centre, label.size))
        label.stand_at(eye.point_at(centre, float(depth)) - offset)


def free_place(
    wanted: Float[np.ndarray, "2"],
    size: Float[np.ndarray, "2"],
    taken: Sequence[Box],
    picture: Float[np.ndarray, "2"],
) -> Float[np.ndarray, "2"]:
    """The centre nearest to the wanted one at which a box is inside the picture and over no other [px].

    Args:
        wanted: centre.
        size: width and height.
        taken: boxes of others.
        picture: width and height.
    """
    rows, columns = np.arange(-ROWS, ROWS + 1), np.arange(-COLUMNS, COLUMNS + 1)
    steps = np.stack(np.meshgrid(0.5 * columns, rows), axis=-1).reshape(-1, 2) * (size + APART_PX)
    low = EDGE_PX + 0.5 * size
    tried = np.clip(wanted + steps, low, np.maximum(picture - low, low))
    for centre in tried[np.argsort(np.linalg.norm(tried - wanted, axis=1), kind="stable")]:
        if not any(_overlap(_box(centre, size), other) for other in taken):
            return centre
    return np.clip(wanted, low, np.maximum(picture - low, low))


def _box(centre: Float[np.ndarray, "2"], size: Float[np.ndarray, "2"]) -> Box:
    (left, upper), (right, lower) = centre - 0.5 * size, centre + 0.5 * size
    return float(left), float(upper), float(right), float(lower)


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
