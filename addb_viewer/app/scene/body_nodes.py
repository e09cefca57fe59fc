"""The fitted skeleton in the scene: one mesh a body, moved by its pose."""

from collections.abc import Set

import numpy as np
import trimesh
import viser

from addb_viewer.app.scene.poses import move
from addb_viewer.app.style.palette import BONE, CAUSE_SURFACE, Rgb
from addb_viewer.app.trial.replay import BodyReplay

SEE_THROUGH = 0.35  # opacity at which markers inside bones show


class BodyNodes:
    """Owns the bones' nodes below one parent."""

    def __init__(
        self,
        scene: viser.SceneApi,
        parent: str,
        replay: BodyReplay,
        meshes: dict[str, trimesh.Trimesh],
        color: Rgb = BONE,
    ) -> None:
        self.replay, self.color = replay, color
        self.known = np.isfinite(replay.position).all(axis=2) & np.isfinite(replay.wxyz).all(axis=2)
        self.handles = {
            index: scene.add_mesh_simple(
                f"{parent}/{index}", meshes[name].vertices, meshes[name].faces, color=color, side="double",
                cast_shadow=False, receive_shadow=False,
            )
            for index, name in enumerate(replay.names)
            if name in meshes
        }  # fmt: skip
        self.marked: Set[int] = frozenset()
        self.see_through = False

    def draw(self, frame: int, *, visible: bool, see_through: bool, marked: Set[int] = frozenset()) -> None:
        """Show one frame; marked bodies in the colour of named causes."""
        for index in self.marked ^ marked:
            if index in self.handles:
                self.handles[index].color = CAUSE_SURFACE if index in marked else self.color
        self.marked = marked
        if see_through != self.see_through:
            self.see_through = see_through
            for handle in self.handles.values():
                handle.opacity = SEE_THROUGH if see_through else None
        position, wxyz = self.replay.position[frame].tolist(), self.replay.wxyz[frame].tolist()
        known = self.known[frame].tolist()
        for index, handle in self.handles.items():
            shown = visible and known[index]
            handle.visible = shown
            if shown:
                move(handle, position[index], wxyz[index])
