"""Force plates in the scene."""

import numpy as np
import viser
from jaxtyping import Float

from addb_viewer.app.scene.force_nodes import ForceSizes
from addb_viewer.app.style.palette import GREY
from addb_viewer.app.trial.replay import PlateReplay

OUTLINE = 0.006  # [m]
BETWEEN_NAMES = 0.35  # [m] two names nearer than this overlap on the screen


class PlateNodes:
    """Outlines and names of the plates; a plate without known corners is named where its force acts."""

    def __init__(self, scene: viser.SceneApi, parent: str, plates: tuple[PlateReplay, ...]) -> None:
        for i, plate in enumerate(plates):
            edges = _edges(plate)
            if edges is not None:
                scene.add_line_segments(f"{parent}/{i}/outline", edges, GREY, thickness=OUTLINE)
        for i, place in name_places(plates).items():
            scene.add_label(
                f"{parent}/{i}/name", plates[i].name, position=place, font_size_mode="scene",
                font_scene_height=0.04, anchor="top-center",
            )  # fmt: skip


def name_places(plates: tuple[PlateReplay, ...]) -> dict[int, Float[np.ndarray, "3"]]:
    """Where each plate's name stands [m], none over another; a plate that is nowhere has none."""
    places: dict[int, Float[np.ndarray, "3"]] = {}
    for i, plate in enumerate(plates):
        place = _name_place(plate)
        if place is None:
            continue
        while any(np.linalg.norm(place - other) < BETWEEN_NAMES for other in places.values()):
            place = place + np.array([BETWEEN_NAMES, 0.0, 0.0])
        places[i] = place
    return places


def _edges(plate: PlateReplay) -> Float[np.ndarray, "4 2 3"] | None:
    """Ends of the four sides; None where the file does not say where the plate is."""
    if plate.corners is None or not np.isfinite(plate.corners).all():
        return None
    return np.stack([plate.corners, np.roll(plate.corners, -1, axis=0)], axis=1)


def _name_place(plate: PlateReplay) -> Float[np.ndarray, "3"] | None:
    """On the edge farthest to the side, where feet and forces do not hide it."""
    edges = _edges(plate)
    if edges is not None:
        middles = edges.mean(axis=1)
        return middles[middles[:, 2].argmax()]
    loaded = np.isfinite(plate.cop).all(axis=1) & (
        np.linalg.norm(plate.force, axis=1) >= ForceSizes().smallest
    )
    return np.median(plate.cop[loaded], axis=0) if loaded.any() else None
