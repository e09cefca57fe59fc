"""Forces and force plates in the scene."""

import numpy as np
import viser
from jaxtyping import Float

from addb_viewer.app.scene.labels import Label, add_label
from addb_viewer.trial_view.palette import GREY, RESIDUAL, TOTAL, UNASSIGNED, Rgb, foot_color
from addb_viewer.trial_view.replay import PlateReplay, Replay, ResidualReplay

METRES_PER_NEWTON = 1e-3  # standing on one leg reaches about the hip
SMALLEST = 20.0  # [N] below it an arrow is noise
SHAFT_RADIUS = 0.010  # [m]
HEAD_RADIUS = 0.026  # [m]
HEAD_LENGTH = 0.07  # [m]
TOTAL_LINE = 0.004  # [m] lines of the hollow arrow of the total
HOLLOW = 0.006  # [m] lines of an arrow that nobody measured


class ForceNodes:
    """One arrow a plate from its centre of pressure, and the residual force at the centre of mass."""

    def __init__(self, scene: viser.SceneApi, parent: str, replay: Replay) -> None:
        self.replay = replay
        self.colors = [foot_color(foot, i) for i, foot in enumerate(replay.feet)]
        self.arrows = [_arrow(scene, f"{parent}/{i}", UNASSIGNED) for i in range(len(replay.plates))]
        self.residual = _arrow(scene, f"{parent}/residual", RESIDUAL) if replay.residual else None
        self.total = TotalNodes(scene, parent, replay.residual) if replay.residual else None
        self.required = [
            scene.add_line_segments(
                f"{parent}/required{i}",
                _NONE,
                foot_color(d.foot, _index(replay.feet, d.foot)),
                thickness=HOLLOW,
                visible=False,
            )
            for i, d in enumerate(replay.required)
        ]

    def draw(
        self, frame: int, *, forces: bool, residual: bool, required: bool = True, total: bool = True
    ) -> None:
        """Show one frame."""
        for force, lines in zip(self.replay.required, self.required, strict=True):
            start, along = force.point[frame], METRES_PER_NEWTON * force.force[frame]
            size = float(np.linalg.norm(force.force[frame]))  # NaN where the foot's force was measured
            lines.visible = required and size >= SMALLEST and bool(np.isfinite(start).all())
            if lines.visible:
                lines.points = hollow_arrow(start, start + along).astype(np.float32)
        for plate, arrow in zip(self.replay.plates, self.arrows, strict=True):
            _point(arrow, plate.cop[frame], plate.force[frame], forces)
            if arrow.visible:
                arrow.colors = np.array(self._color(int(plate.foot[frame])).linear, dtype=np.uint8)
        if self.residual is not None and self.replay.residual is not None:
            r = self.replay.residual
            _point(self.residual, r.com[frame], r.force[frame], residual)
        if self.total is not None:
            self.total.draw(frame, visible=total)

    def _color(self, foot: int) -> Rgb:
        return self.colors[foot] if 0 <= foot < len(self.colors) else UNASSIGNED


class TotalNodes:
    """At the centre of mass: all measured forces that count, and hollow, what the motion demands."""

    def __init__(self, scene: viser.SceneApi, parent: str, residual: ResidualReplay) -> None:
        self.residual, self.demands = residual, residual.required
        self.measured = _arrow(scene, f"{parent}/total", TOTAL)
        self.measured.shaft_radius, self.measured.head_radius = HOLLOW, 2 * HOLLOW
        self.required = scene.add_line_segments(
            f"{parent}/total_required", _NONE, TOTAL, thickness=TOTAL_LINE, visible=False
        )

    def draw(self, frame: int, *, visible: bool) -> None:
        """Show one frame."""
        r = self.residual
        if r.counted is None or self.demands is None:
            return
        _point(self.measured, r.com[frame], r.counted[frame], visible)
        size = float(np.linalg.norm(self.demands[frame]))  # NaN outside the fit
        self.required.visible = visible and size >= SMALLEST and bool(np.isfinite(r.com[frame]).all())
        if self.required.visible:
            tip = r.com[frame] + METRES_PER_NEWTON * self.demands[frame]
            self.required.points = hollow_arrow(r.com[frame], tip).astype(np.float32)


_NONE = np.array([[[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]], dtype=np.float32)
EDGES = 6  # of a hollow arrow


def hollow_arrow(
    start: Float[np.ndarray, "3"], tip: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "segments 2 3"]:
    """The edges of an arrow's shaft and head [m], so that it shows as a shape without a body."""
    along = tip - start
    length = float(np.linalg.norm(along))
    axis = along / length
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    turns = np.linspace(0.0, 2.0 * np.pi, EDGES, endpoint=False)[:, None]
    ring = np.cos(turns) * across + np.sin(turns) * np.cross(axis, across)
    neck = tip - min(HEAD_LENGTH, 0.6 * length) * axis
    shaft, rim = neck + 1.3 * SHAFT_RADIUS * ring, neck + 1.3 * HEAD_RADIUS * ring
    foot = start + 1.3 * SHAFT_RADIUS * ring
    tips = np.broadcast_to(tip, rim.shape)
    return np.concatenate(
        [
            np.stack([foot, shaft], axis=1)[::2],
            np.stack([rim, np.roll(rim, -1, axis=0)], axis=1),
            np.stack([rim, tips], axis=1)[::2],
        ]
    )


def _index(feet: tuple[str, ...], foot: str) -> int:
    return feet.index(foot) if foot in feet else 0


def _arrow(scene: viser.SceneApi, name: str, color: Rgb) -> viser.ArrowsHandle:
    return scene.add_arrows(
        name, np.array([[[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]]), np.array(color.linear, dtype=np.uint8),
        shaft_radius=SHAFT_RADIUS, head_radius=HEAD_RADIUS, head_length=HEAD_LENGTH,
        visible=False,
    )  # fmt: skip


def _point(
    arrow: viser.ArrowsHandle, start: Float[np.ndarray, "3"], force: Float[np.ndarray, "3"], wanted: bool
) -> None:
    known = np.isfinite(start).all() and np.isfinite(force).all()
    shown = bool(wanted and known and np.linalg.norm(force) >= SMALLEST)
    arrow.visible = shown
    if shown:
        arrow.points = np.stack([start, start + METRES_PER_NEWTON * force])[None].astype(np.float32)


OUTLINE = 0.010  # [m]
SURFACE, ABOVE = 0.14, 0.002  # opacity of a plate; [m] over the floor's lines, which would shine through
TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])  # of four corners
MOSTLY = 0.9  # of a plate's loaded frames: it serves that foot


class PlateNodes:
    """Plates in the colour of the foot that they serve, and names; one without corners has a name alone."""

    def __init__(
        self, scene: viser.SceneApi, parent: str, plates: tuple[PlateReplay, ...], feet: tuple[str, ...]
    ) -> None:
        self.labels: list[Label] = []
        for i, plate in enumerate(plates):
            edges, foot = _edges(plate), served_foot(plate)
            if edges is not None:
                color = GREY if foot is None or foot >= len(feet) else foot_color(feet[foot], foot)
                scene.add_line_segments(f"{parent}/{i}/outline", edges, color, thickness=OUTLINE)
                scene.add_mesh_simple(
                    f"{parent}/{i}/surface", edges[:, 0] + [0.0, ABOVE, 0.0], TWO_TRIANGLES, color=color,
                    opacity=SURFACE, side="double", cast_shadow=False, receive_shadow=False,
                )  # fmt: skip
            place = name_place(plate)
            if place is not None:
                of = place[None] if edges is None else edges.reshape(-1, 3)
                self.labels.append(add_label(scene, f"{parent}/{i}/name", plate.name, place, side=-1, of=of))


def served_foot(plate: PlateReplay) -> int | None:
    """The foot that nearly all of the plate's load goes to, as an index; None where there is no such foot."""
    loaded = np.linalg.norm(plate.force, axis=1) >= SMALLEST  # NaN is none
    feet, frames = np.unique(plate.foot[loaded & (plate.foot >= 0)], return_counts=True)
    if not len(feet) or frames.max() < MOSTLY * frames.sum():
        return None
    return int(feet[frames.argmax()])


def _edges(plate: PlateReplay) -> Float[np.ndarray, "4 2 3"] | None:
    """Ends of the four sides; None where the file does not say where the plate is."""
    if plate.corners is None or not np.isfinite(plate.corners).all():
        return None
    return np.stack([plate.corners, np.roll(plate.corners, -1, axis=0)], axis=1)


def name_place(plate: PlateReplay) -> Float[np.ndarray, "3"] | None:
    """On the edge farthest to the side, where feet and forces do not hide it [m]; None: it is nowhere."""
    edges = _edges(plate)
    if edges is not None:
        middles = edges.mean(axis=1)
        return middles[middles[:, 2].argmax()]
    loaded = np.isfinite(plate.cop).all(axis=1) & (np.linalg.norm(plate.force, axis=1) >= SMALLEST)
    return np.median(plate.cop[loaded], axis=0) if loaded.any() else None
