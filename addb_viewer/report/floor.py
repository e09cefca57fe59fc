"""What lies on the floor of a trial: plates, or where their forces acted when the file has no corners."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from addb_viewer.trial_view.drawing import SMALLEST_N
from addb_viewer.trial_view.replay import PlateReplay, Replay

MOST_POINTS = 120  # of a trace: enough to see where the force went
AROUND_M = 1.0  # of floor beyond markers and plates
GRID_M = 0.5


@dataclass(frozen=True)
class PlateDrawing:
    """A plate: its outline, or the trace of its centre of pressure; either may be empty."""

    name: str
    outline: Float[np.ndarray, "corners 3"]  # [m]
    trace: Float[np.ndarray, "points 3"]  # [m] where it was loaded


def plates_of(replay: Replay) -> tuple[PlateDrawing, ...]:
    """All plates of a trial."""
    return tuple(_drawing(plate) for plate in replay.plates)


def grid(low: Float[np.ndarray, "2"], high: Float[np.ndarray, "2"]) -> Float[np.ndarray, "lines 2 3"]:
    """Lines on the floor half a metre apart, between two corners [m] along x and z."""
    x0, z0 = (np.floor(value / GRID_M) * GRID_M for value in low)
    x1, z1 = (np.ceil(value / GRID_M) * GRID_M for value in high)
    across = [[(x, 0, z0), (x, 0, z1)] for x in np.arange(x0, x1 + 1e-6, GRID_M)]
    along = [[(x0, 0, z), (x1, 0, z)] for z in np.arange(z0, z1 + 1e-6, GRID_M)]
    return np.array([*across, *along], dtype=float)


def walked_floor(replay: Replay) -> Float[np.ndarray, "lines 2 3"]:
    """The grid around all that was measured."""
    seen = replay.markers.measured[np.isfinite(replay.markers.measured).all(axis=2)]
    if not len(seen):
        return np.zeros((0, 2, 3))
    low, high = seen.min(axis=0) - AROUND_M, seen.max(axis=0) + AROUND_M
    return grid(low[[0, 2]], high[[0, 2]])


def _drawing(plate: PlateReplay) -> PlateDrawing:
    outline = np.zeros((0, 3))
    if plate.corners is not None and np.isfinite(plate.corners).all():
        outline = np.concatenate([plate.corners, plate.corners[:1]])
    with np.errstate(invalid="ignore"):
        loaded = np.linalg.norm(plate.force, axis=1) >= SMALLEST_N
    trace = plate.cop[loaded & np.isfinite(plate.cop).all(axis=1)]
    return PlateDrawing(plate.name, outline, trace[:: max(1, -(-len(trace) // MOST_POINTS))])
