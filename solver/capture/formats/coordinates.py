"""Generalized coordinates in .mot and .sto files, in degrees or radians, also where the header forgets it."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.formats.storage import Storage, write_storage
from solver.common.notes import Kind, Note

# No joint turns by more than a whole turn, and the heading only where somebody walks in circles: if two
# columns go beyond this many radians the file is in degrees.
RADIANS_AT_MOST = 2 * np.pi


@dataclass(frozen=True)
class Coordinates:
    """Generalized coordinates over time: radians and metres."""

    names: tuple[str, ...]
    values: Float[np.ndarray, "rows coordinates"]  # [rad or m]
    times: Float[np.ndarray, " rows"]  # [s]
    notes: tuple[Note, ...] = ()


def coordinates_from_storage(storage: Storage, rotational: Collection[str]) -> Coordinates:
    """Coordinates in radians and metres from a table of inverse kinematics.

    Args:
        storage: a column for each coordinate.
        rotational: the coordinates that are angles in the file's units. In OpenSim's files these are the
            ones of motion type "rotational" only; coupled ones, such as `knee_angle_r_beta`, stay in radians.
    """
    columns = [k for k, label in enumerate(storage.labels) if label in rotational]
    in_degrees, notes = storage.in_degrees, storage.notes
    if in_degrees is None:
        in_degrees, note = _looks_like_degrees(storage.values[:, columns], storage.path.name)
        notes = (*notes, note)
    values = storage.values.copy()
    if in_degrees:
        values[:, columns] = np.radians(values[:, columns])
    return Coordinates(storage.labels, values, storage.times, notes)


def write_coordinates(
    path: Path,
    names: Sequence[str],
    times: Float[np.ndarray, " rows"],
    values: Float[np.ndarray, "rows coordinates"],
    *,
    rotational: Collection[str],
    in_degrees: bool = True,
) -> None:
    """Write coordinates [rad or m] as OpenSim's tools expect them.

    Args:
        path: the .mot file.
        names: of the coordinates.
        times: [s].
        values: [rad or m].
        rotational: which ones turn into degrees.
        in_degrees: whether they do.

    Raises:
        CaptureError: the file cannot be written.
    """
    scale = np.array([180 / np.pi if in_degrees and name in rotational else 1.0 for name in names])
    write_storage(path, names, times, values * scale, in_degrees=in_degrees, name="Coordinates")


def _looks_like_degrees(angles: Float[np.ndarray, "rows angles"], source: str) -> tuple[bool, Note]:
    largest = np.sort(np.nanmax(np.abs(angles), axis=0, initial=0.0))
    second = float(largest[-2:].min(initial=np.inf)) if len(largest) else 0.0
    in_degrees = second > RADIANS_AT_MOST
    return in_degrees, Note(
        Kind.OTHER,
        f"{source}: the header doesn't say whether angles are degrees; "
        f"{'degrees' if in_degrees else 'radians'} assumed, since the second largest reaches {second:.3g}",
    )
