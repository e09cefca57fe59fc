"""Recordings whose plates count the other way round, or have a constant on them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reading_settings.bench import captures
from solver.capture.capture import ForcePlate, Markers
from solver.capture.plate_levels import plate_witnesses
from solver.capture.plate_sign_settings import PlateSignSettings

LEVELS_N = (250.0, -150.0)
MOST_PLATES = 3  # more take long, and tell no more
Truth = tuple[bool, bool]
"""Whether a plate is turned, and untared."""


@dataclass(frozen=True, eq=False)
class Miswired:
    """One of them."""

    person: str
    plates: tuple[ForcePlate, ...]
    markers: Markers
    mass_kg: float | None
    truth: tuple[Truth, ...]

    def answers(self, settings: PlateSignSettings) -> Sequence[object]:
        """What is found of each plate."""
        found = plate_witnesses(self.plates, self.markers, self.mass_kg, settings)
        return tuple((one.is_turned(settings), one.is_untared(settings)) for one in found)


def miswired() -> Iterator[Miswired]:
    """Every recording with few plates: as it is, all turned, the first turned, the first untared."""
    for person, capture, mass_kg in captures():
        if 0 < len(capture.plates) <= MOST_PLATES:
            for plates, truth in _changed(capture.plates):
                yield Miswired(person, plates, capture.markers, mass_kg, truth)


def _changed(plates: Sequence[ForcePlate]) -> Iterator[tuple[tuple[ForcePlate, ...], tuple[Truth, ...]]]:
    first, rest = plates[0], tuple(plates[1:])
    sound: tuple[Truth, ...] = ((False, False),) * len(rest)
    yield tuple(plates), ((False, False), *sound)
    yield tuple(_turned(plate) for plate in plates), ((True, False),) * len(plates)
    if rest:
        yield (_turned(first), *rest), ((True, False), *sound)
    for level_N in LEVELS_N:
        level = replace(first, force_ground=first.force_ground + np.array([0.0, level_N, 0.0]))
        yield (level, *rest), ((False, True), *sound)


def _turned(plate: ForcePlate) -> ForcePlate:
    return replace(plate, force_ground=-plate.force_ground, moment_ground=-plate.moment_ground)
