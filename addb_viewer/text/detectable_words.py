"""What "nothing wrong" is worth: from which size on the usual causes would have been found."""

import math
from collections.abc import Mapping

from addb_viewer.text.diagnosis_vocabulary import behind, target_in_words
from addb_viewer.text.sections import Section
from solver.diagnosis.causes.about import Reading
from solver.diagnosis.causes.catalogue import ABOUT
from solver.diagnosis.diagnosis_report import DiagnosisReport

HEADING = "What would have been found"
DIGITS = 2  # of a size, rounded up
BLIND = "this recording cannot tell"
MOST_TARGETS = 2  # that are told one by one


def what_would_be_found(figures: DiagnosisReport) -> Section:
    """Sizes of each cause at each target, the largest over directions; empty where none is known."""
    rows = tuple(
        (_title(id), BLIND if _is_blind(id, sizes) else _told(sizes)) for id, sizes in _sizes(figures).items()
    )
    if not rows:
        return Section(HEADING)
    line = (
        "One of these would have been found nine times in ten from this size on, in the worst direction. "
        "Smaller ones may be there. For the other causes on the list no such size is known."
    )
    return Section(HEADING, (line,), rows)


def cannot_tell(figures: DiagnosisReport) -> list[str]:
    """Causes that would not have been found at any size that makes sense."""
    return [_title(id) for id, sizes in _sizes(figures).items() if _is_blind(id, sizes)]


def _sizes(figures: DiagnosisReport) -> dict[str, dict[str, tuple[float, str]]]:
    """Of each cause at each target the largest over directions, and its unit."""
    largest: dict[str, dict[str, tuple[float, str]]] = {}
    for one in figures.detectable:
        unit, factor = _unit_of(one.id, one.parameter)
        sizes = largest.setdefault(one.id, {})
        before, _ = sizes.get(one.target, (0.0, unit))
        sizes[one.target] = max(before, factor * one.size), unit
    return largest


def _is_blind(id: str, sizes: Mapping[str, tuple[float, str]]) -> bool:
    largest = ABOUT[id].asked_up_to if id in ABOUT else None
    return largest is not None and min(size for size, _ in sizes.values()) > largest


def _title(id: str) -> str:
    return ABOUT[id].title.format(target="a plate")


def _told(sizes: Mapping[str, tuple[float, str]]) -> str:
    """Each target's, or one for all where they are alike, or of many the best and the worst."""
    ordered = sorted(sizes, key=lambda target: sizes[target])
    if len({_rounded_up(*size) for size in sizes.values()}) == 1:
        return _rounded_up(*sizes[ordered[0]])
    told = list(sizes) if len(sizes) <= MOST_TARGETS else [ordered[0], ordered[-1]]
    between = ", " if len(sizes) <= MOST_TARGETS else " to "
    return between.join(f"{_rounded_up(*sizes[target])} ({target_in_words(target)})" for target in told)


def _unit_of(id: str, parameter: str) -> tuple[str, float]:
    for reading in ABOUT[id].readings:
        if isinstance(reading, Reading) and reading.parameter == parameter:
            return reading.unit, abs(reading.factor)
    return "", 1.0


def _rounded_up(size: float, unit: str) -> str:
    place = math.floor(math.log10(size)) + 1 - DIGITS
    rounded = 10.0**place * math.ceil(round(size / 10.0**place, 6))
    return f"{rounded:.{max(0, -place)}f}{behind(unit)}"
