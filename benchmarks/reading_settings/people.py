"""Recordings of one person and of two: of different trials, and of a trial whose end is somebody taller's."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

from benchmarks.reading_settings.bench import captures
from solver.capture.body_lengths import BodyLengthSettings, Lengths, body_lengths, odds_for_two
from solver.capture.capture import Markers

TWO_PEOPLE = 3.0  # [log odds] 20 to 1, of body lengths
ONE, TWO, NOT_TOLD = "one person", "two people", "not told"
TALLER = 1.06  # as far as a bone's length scatters among adults


@dataclass(frozen=True, eq=False)
class Seen:
    """Markers of one person."""

    person: str
    markers: Markers


@dataclass(frozen=True, eq=False)
class Couple:
    """Two recordings, and whether they show one person."""

    one: Seen
    other: Seen
    right: str

    @property
    def person(self) -> str:
        """Of the first."""
        return self.one.person

    @property
    def truth(self) -> Sequence[object]:
        """How many people, and that nothing wrong is said."""
        return (self.right, False)

    def answers(self, settings: BodyLengthSettings) -> Sequence[object]:
        """How many people the lengths tell of, and whether that is wrong."""
        odds = odds_for_two(_lengths(self.one, settings), _lengths(self.other, settings), settings)
        told = NOT_TOLD
        if odds is not None and not 0 <= odds < TWO_PEOPLE:
            told = ONE if odds < 0 else TWO
        return (told, told not in (self.right, NOT_TOLD))


@lru_cache(maxsize=256)  # all recordings, whole and by halves, with one value of a setting
def _lengths(seen: Seen, settings: BodyLengthSettings) -> Lengths:
    return body_lengths(seen.markers, settings)


def couples() -> Iterator[Couple]:
    """All pairs of recordings that share a length, and both halves of each recording, of one and of two."""
    usual, every = BodyLengthSettings(), [Seen(one.person, one.capture.markers) for one in captures()]
    for one, other in combinations(every, 2):
        if _lengths(one, usual).keys() & _lengths(other, usual).keys():
            yield Couple(one, other, ONE if one.person == other.person else TWO)
    for one in every:
        half = one.markers.frames // 2
        begins, ends = (
            replace(one.markers, positions_ground=one.markers.positions_ground[part])
            for part in (slice(half), slice(half, 2 * half))
        )
        first = Seen(one.person, begins)
        yield Couple(first, Seen(one.person, ends), ONE)
        taller = replace(ends, positions_ground=TALLER * ends.positions_ground)
        yield Couple(first, Seen(one.person, taller), TWO)
