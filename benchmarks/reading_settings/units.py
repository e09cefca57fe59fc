"""Markers in millimetres, centimetres and metres, in files that do not say so."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.reading_settings.bench import captures
from solver.capture.length_units import METRES_PER_UNIT, LengthUnitSettings, metres_per_unit
from solver.errors import CaptureError


@dataclass(frozen=True, eq=False)
class Unsaid:
    """One of them."""

    person: str
    positions: np.ndarray
    truth: tuple[float]  # metres of its unit

    def answers(self, settings: LengthUnitSettings) -> Sequence[object]:
        """Metres of the unit that is guessed; None where the file is refused."""
        try:
            return (metres_per_unit(None, self.positions, Path("some.trc"), settings=settings)[0],)
        except CaptureError:
            return (None,)


def unsaid() -> Iterator[Unsaid]:
    """Every recording in every unit."""
    for person, capture, _ in captures():
        for metres in METRES_PER_UNIT.values():
            yield Unsaid(person, capture.markers.positions_ground / metres, (metres,))
