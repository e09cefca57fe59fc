"""The 3-D scene of one trial. Everything hangs below one frame that glides along; cameras stand still."""

from dataclasses import dataclass, replace

import numpy as np
import trimesh
import viser
from jaxtyping import Float, UInt8

from addb_viewer.app.scene.camera import Eye
from addb_viewer.app.scene.cause_nodes import LINE_HEIGHT, OVER_HEAD, CauseNodes
from addb_viewer.app.scene.force_nodes import ForceNodes, PlateNodes
from addb_viewer.app.scene.labels import settle
from addb_viewer.app.scene.legend import BY_NOTHING, legend_html, tints
from addb_viewer.app.scene.measuring import Measuring, marker_words
from addb_viewer.app.scene.person_nodes import BodyNodes, MarkerNodes
from addb_viewer.trial_view.cause_pictures import pictures
from addb_viewer.trial_view.palette import OTHER_SOLVE
from addb_viewer.trial_view.replay import BodyReplay, Replay
from solver.diagnosis.diagnosis_report import DiagnosisReport

LAB, TRIAL = "/lab", "/lab/trial"
HULL = 0.003  # [m] by which the other solve's bones lie around those of this one: equal surfaces flicker
PELVIS_TO_MIDDLE = 0.93  # half of a standing person's height over the pelvis' (Winter 2009: 0.50 over 0.54)


@dataclass
class SceneOptions:
    """What the reviewer has switched on."""

    bones: bool = True
    see_through: bool = False
    model_markers: bool = True
    trail_seconds: float = 0.0
    forces: bool = True
    required: bool = True
    residual: bool = True
    total: bool = True
    causes: bool = True
    other: bool = True  # the skeleton of the solve that this one is compared with
    follow: bool = True
    tint: str = BY_NOTHING  # what the bones' colour says: one of `TINTS`


class TrialScene:
    """Owns all nodes of the scene of one browser; or, given the server, of one that all see."""

    measuring: Measuring  # of the trial that is shown

    def __init__(self, server: viser.ViserServer | viser.ClientHandle) -> None:
        self.server = server
        self.options = SceneOptions()
        # Colours mean something here: light that keeps them, and no shadows, which software renders slowly.
        server.scene.configure_environment_map(None)
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.add_light_ambient("/light", intensity=0.7)
        self.lab = server.scene.add_frame(LAB, show_axes=False)
        server.scene.add_grid(
            f"{LAB}/ground", infinite_grid=True, plane="xz", cell_size=0.25, section_size=1.0,
            fade_distance=12.0, cell_color=(195, 195, 195), section_color=(150, 150, 150), shadow_opacity=0.0,
        )  # fmt: skip
        self.replay: Replay | None = None
        self.figures: DiagnosisReport | None = None
        self.other: BodyNodes | None = None
        self._painted: tuple[str, UInt8[np.ndarray, "frames bodies 3"] | None] | None = (
            None  # kind and colours
        )
        self.path = np.zeros((1, 3))
        self.anchor = np.zeros(3)

    def show(self, replay: Replay, meshes: dict[str, trimesh.Trimesh], frame: int = 0) -> None:
        """Put another trial in place of the present one and draw a frame of it."""
        scene, measures = self.server.scene, self.replay is not None and self.measuring.on
        with self.server.atomic():
            scene.remove_by_name(TRIAL)
            scene.add_frame(TRIAL, show_axes=False)
            self.replay, self.other, self._painted = replay, None, None
            self.markers = MarkerNodes(scene, f"{TRIAL}/markers", replay.markers, replay.rate)
            self.bodies = (
                BodyNodes(scene, f"{TRIAL}/bodies", replay.bodies, meshes) if replay.bodies else None
            )
            self.plates = PlateNodes(scene, f"{TRIAL}/plates", replay.plates, replay.feet)
            self.forces = ForceNodes(scene, f"{TRIAL}/forces", replay)
            self.measuring = Measuring(scene, f"{TRIAL}/measured", replay, meshes)
            self.measuring.switch(measures)
            self.path = followed_path(replay)
            self.anchor = np.zeros(3)
            self._add_causes()
            self.draw(frame)

    def compare(self, bodies: BodyReplay | None, meshes: dict[str, trimesh.Trimesh]) -> None:
        """Draw another solve's skeleton into this one, see-through; None: no more.

        Args:
            bodies: of the same trial.
            meshes: of that solve's skeleton.
        """
        with self.server.atomic():
            self.server.scene.remove_by_name(f"{TRIAL}/other")
            self.other = None
            if bodies is not None:
                parent = f"{TRIAL}/other"
                self.other = BodyNodes(
                    self.server.scene, parent, bodies, meshes, color=OTHER_SOLVE, hull=HULL
                )

    def explain(self, figures: DiagnosisReport | None) -> None:
        """Draw the causes of a diagnosis from now on, in place of those of another; None for no diagnosis.

        Args:
            figures: of the diagnosis.
        """
        self.figures = figures
        if self.replay is not None:
            with self.server.atomic():
                self._add_causes()

    def _add_causes(self) -> None:
        assert self.replay is not None
        self.server.scene.remove_by_name(f"{TRIAL}/causes")
        drawn = pictures(self.figures, self.replay) if self.figures is not None else ()
        markers = self.replay.markers
        self.causes = CauseNodes(self.server.scene, f"{TRIAL}/causes", drawn, self.path, markers)

    def draw(self, frame: int, eye: Eye | None = None) -> None:
        """Move everything to one frame, in one message to every browser.

        Args:
            frame: of the trial.
            eye: that looks at it: labels are moved to where they are whole; None: they stay at their places.
        """
        if self.replay is None:
            return
        o = self.options
        with self.server.atomic():
            self.markers.draw(
                frame,
                with_model=o.model_markers,
                with_lost=bool(self.replay.in_view[frame]),
                trail_seconds=o.trail_seconds,
            )
            if self.bodies is not None:
                marked = self.causes.marked_bodies(frame, visible=o.causes)
                self.bodies.draw(
                    frame, visible=o.bones, see_through=o.see_through, marked=marked, tints=self._tints(frame)
                )
            if self.other is not None:
                self.other.draw(frame, visible=o.other, see_through=True)
            self.forces.draw(frame, forces=o.forces, residual=o.residual, required=o.required, total=o.total)
            self.causes.draw(frame, visible=o.causes)
            self.measuring.draw(frame)
            if o.follow:
                self.lab.position = self.anchor - self.path[frame]
            if eye is not None:
                labels = [self.measuring.label, *self.causes.labels, *self.plates.labels]
                settle(labels, eye, self.lab.position)

    def measure(self, frame: int, eye: Eye, place: Float[np.ndarray, "2"]) -> bool:
        """Take a click of the measuring tool; arguments and result as for `Measuring.click`."""
        return self.measuring.click(frame, self._in_lab(eye), place)

    def pointed_at(self, frame: int, eye: Eye, place: Float[np.ndarray, "2"]) -> str:
        """Which marker is under the pointer; arguments and result as for `marker_words`."""
        assert self.replay is not None
        return marker_words(self.replay, frame, self._in_lab(eye), place)

    def _in_lab(self, eye: Eye) -> Eye:
        return replace(eye, position=eye.position - self.lab.position)

    @property
    def legend(self) -> str:
        """What the colours mean, as a piece of the page."""
        if self.replay is None:
            return ""
        return legend_html(self.replay, diagnosed=self.figures is not None, tint=self.options.tint)

    def _tints(self, frame: int) -> UInt8[np.ndarray, "bodies 3"] | None:
        assert self.replay is not None
        if self._painted is None or self._painted[0] != self.options.tint:
            self._painted = self.options.tint, tints(self.replay, self.options.tint)
        colors = self._painted[1]
        return None if colors is None else colors[frame]

    def center(self, frame: int) -> Float[np.ndarray, "3"]:
        """The middle of the person as the cameras see it [m]: the pelvis, else half-way up the markers."""
        assert self.replay is not None
        bodies, heights = self.replay.bodies, self.markers.tracks.held[frame, :, 1]
        middle = 0.5 * (float(heights.min()) + float(heights.max())) if heights.size else 1.0
        if bodies is not None and np.isfinite(bodies.position[frame, bodies.root, 1]):
            middle = PELVIS_TO_MIDDLE * float(bodies.position[frame, bodies.root, 1])
        return self.lab.position + self.path[frame] + np.array([0.0, middle, 0.0])

    def extent(self, frame: int) -> Float[np.ndarray, "points 3"]:
        """Where the person is on a frame [m], as cameras see it: markers, bones and labels."""
        assert self.replay is not None
        points = self.markers.tracks.held[frame].astype(float)
        if self.bodies is not None and self.bodies.known[frame].any():
            points = np.concatenate([points, self.bodies.extent(frame)])
        if self.causes.labels:
            top = [[0.0, OVER_HEAD + 2 * LINE_HEIGHT, 0.0]]
            points = np.concatenate([points, self.path[frame] + top])
        return self.lab.position + points[np.isfinite(points).all(axis=1)]

    def follow(self, on: bool, frame: int) -> None:
        """Start or stop following the pelvis without a jump of the picture."""
        self.anchor = self.lab.position + self.path[frame]
        self.options.follow = on


def followed_path(replay: Replay) -> Float[np.ndarray, "frames 3"]:
    """Where the person is on the ground [m]: the root body, else the middle of the markers seen."""
    if replay.bodies is not None:
        path = replay.bodies.position[:, replay.bodies.root].copy()
    else:
        path = _middle(replay.markers.measured)
    path[:, 1] = 0.0
    return _bridged(path)


def heading(replay: Replay) -> Float[np.ndarray, "3"]:
    """Horizontal unit vector to where the person faces on the whole; without a skeleton, where they go."""
    path = followed_path(replay)
    if replay.bodies is not None and replay.bodies.forward is not None:
        direction = np.nanmean(replay.bodies.forward, axis=0)
    else:
        direction = path[-1] - path[0]
    direction = np.nan_to_num(direction) * [1.0, 0.0, 1.0]
    length = np.linalg.norm(direction)
    return direction / length if length > 0.1 else np.array([1.0, 0.0, 0.0])


def _middle(measured: Float[np.ndarray, "frames markers 3"]) -> Float[np.ndarray, "frames 3"]:
    """Mean over the markers seen, on frames that see at least half of them; NaN on the others."""
    seen = np.isfinite(measured).all(axis=2)
    count = seen.sum(axis=1)
    total = np.where(seen[:, :, None], measured, 0.0).sum(axis=1)
    enough = 2 * count >= max(count.max(initial=0), 1)
    return np.where(enough[:, None], total / np.maximum(count, 1)[:, None], np.nan)


def _bridged(path: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 3"]:
    """Linear across frames that know nothing; zero if none knows anything."""
    known = np.isfinite(path).all(axis=1)
    if not known.any():
        return np.zeros_like(path)
    rows = np.arange(len(path))
    return np.stack([np.interp(rows, rows[known], path[known, k]) for k in range(3)], axis=1)
