"""Recordings in axes of which another one points up; with and without plates and names of markers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reading_settings.bench import captures
from solver.capture.axes import AxesSettings, VerticalAxis, vertical_axis
from solver.capture.capture import Markers

WAYS_UP = (VerticalAxis(1, 1, ()), VerticalAxis(0, -1, ()))
DEFAULT = "z"  # as for C3D files


@dataclass(frozen=True, eq=False)
class Turned:
    """One of them."""

    person: str
    up: VerticalAxis
    markers: Markers
    forces: tuple[np.ndarray, ...]
    corners: tuple[np.ndarray, ...]

    @property
    def truth(self) -> Sequence[object]:
        """Axis and sign."""
        return ((self.up.axis, self.up.sign),)

    def answers(self, settings: AxesSettings) -> Sequence[object]:
        """What is found to point up."""
        found = vertical_axis(self.markers, self.forces, self.corners, default=DEFAULT, settings=settings)
        return ((found.axis, found.sign),)


def turned() -> Iterator[Turned]:
    """Every recording, upright and lying on its side."""
    for person, capture, _ in captures():
        for up in WAYS_UP:
            R = up.R_ground_lab
            markers = replace(capture.markers, positions_ground=capture.markers.positions_ground @ R)
            nameless = replace(markers, names=tuple(f"M{k}" for k in range(len(markers.names))))
            forces = tuple(plate.force_ground @ R for plate in capture.plates)
            known = [plate.corners_ground for plate in capture.plates]
            corners = tuple(corner @ R for corner in known if corner is not None)
            for seen in (markers, nameless):
                yield Turned(person, up, seen, forces, corners)
                yield Turned(person, up, seen, (), ())
