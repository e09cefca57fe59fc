"""Markers against forces of the same recording, of the same one but later, and of the next one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from benchmarks.reading_settings.bench import captures
from solver.capture.capture import ForcePlate, Markers
from solver.capture.loads_under_feet import UnderFeetSettings, evidence, feet_of, loads_of
from solver.capture.reading_settings import ForceFileSettings

LATE_S = (0.12, 0.25)  # parts of a step
MOST_FRAMES = 300  # longer ones take long, and tell no more


@dataclass(frozen=True, eq=False)
class Pair:
    """Markers and plates on one clock."""

    person: str  # of the markers
    markers: Markers
    plates: tuple[ForcePlate, ...]
    truth: tuple[bool]  # whether they belong together

    def answers(self, settings: UnderFeetSettings) -> Sequence[object]:
        """Whether the loads alone would make a pair of them; None where there are none."""
        loads = loads_of(self.plates, settings)
        if loads is None:
            return (None,)
        found = evidence(feet_of(self.markers, settings), loads, settings)
        return (found.log_odds > ForceFileSettings.taken,)


def pairs() -> Iterator[Pair]:
    """Of each short recording: its own forces, the same later, and those of the next one."""
    short = [one for one in captures() if one.capture.markers.frames <= MOST_FRAMES]
    for (person, capture, _), (_, other, _) in zip(short, [*short[1:], short[0]], strict=True):
        yield Pair(person, capture.markers, tuple(capture.plates), (True,))
        yield Pair(person, capture.markers, tuple(other.plates), (False,))
        for late_s in LATE_S:
            late = [replace(plate, start_time=plate.start_time + late_s) for plate in capture.plates]
            yield Pair(person, capture.markers, tuple(late), (False,))
