"""How a stage declares a setting: default, unit, the reason for that value beside it, and what it may be."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar

Value = TypeVar("Value")


@dataclass(frozen=True)
class Bounds:
    """Of every number of a setting; lengths, times, scatters and shares that divide are greater than zero."""

    least: float | None  # None: greater than zero
    below: float

    def allow(self, value: object) -> bool:
        """Whether a value, or every number in a list of them, is within."""
        return all(self._allows(number) for number in _numbers(value))

    def __str__(self) -> str:
        """As an error says it after "expected"."""
        told = [] if self.least == -math.inf else [_told(self.least)]
        return " and ".join([*told, f"less than {self.below:g}"] if self.below < math.inf else told)

    def _allows(self, number: float) -> bool:
        return number < self.below and (number > 0.0 if self.least is None else number >= self.least)


def setting(
    default: Value, unit: str, why: str, *, least: float | None = None, below: float = math.inf
) -> Value:
    """A field of a stage's frozen Settings dataclass; `addb-viewer settings` prints `unit` and `why`.

    Args:
        default: the value used when nobody says otherwise.
        unit: of the value, as in "Hz" or "m"; "" for one without.
        why: the reason for the default, with its source where there is one.
        least: the smallest number that it may be; None: any that is greater than zero.
        below: every number of it is smaller.
    """
    metadata = {"unit": unit, "why": why, "bounds": Bounds(least, below)}
    described: Value = field(default=default, metadata=metadata)
    return described


def _told(least: float | None) -> str:
    return "greater than 0" if least is None else f"at least {least:g}"


def _numbers(value: object) -> Iterator[float]:
    if isinstance(value, list | tuple):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value
