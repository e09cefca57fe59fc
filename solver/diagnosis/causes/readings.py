"""How the parameters of a cause are said: sense, unit and which sign means what."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

OF_EACH_TRIAL = "{trial}"  # in the name of a parameter that each trial has, and in its text


@dataclass(frozen=True)
class Reading:
    """How one parameter is said: `{amount}`, `{signed}`, and `{which}` by its sign (above zero, below)."""

    parameter: str
    text: str
    unit: str
    factor: float = 1.0  # from the parameter's unit to `unit`
    zero: float = 0.0  # what no effect is
    which: tuple[str, str] | None = None


@dataclass(frozen=True)
class Place:
    """How three parameters that make one point are said together: `{distance}` and `{point}`."""

    parameters: str  # with {} for the axis
    text: str
    unit: str
    factor: float = 1.0
    unknown: str = ""  # said instead of a point whose spread is larger than its distance


def along(
    parameters: str, text: str, unit: str, factor: float = 1.0, axes: str = "xyz"
) -> tuple[Reading, ...]:
    """One reading an axis, its sign told as the end of the axis that it points to.

    Args:
        parameters: their names, with {} for the axis.
        text: likewise.
        unit: as said.
        factor: from the parameters' unit to that.
        axes: of these.
    """
    return tuple(
        Reading(parameters.format(a), text.format(a), unit, factor, which=(f"+{a}", f"−{a}")) for a in axes
    )


NOT_TOLD = "this recording does not show"
ON_SEGMENT = "{distance} from the segment's origin, at {point} in its axes"


def of_each_trial(readings: Iterable[Reading | Place], parameters: Iterable[str]) -> list[Reading | Place]:
    """Readings of a parameter that each trial has, one for each trial; the others as they are.

    Args:
        readings: of a cause.
        parameters: names in its answer.
    """
    said: list[Reading | Place] = []
    for reading in readings:
        if isinstance(reading, Place) or OF_EACH_TRIAL not in reading.parameter:
            said.append(reading)
            continue
        before, after = reading.parameter.split(OF_EACH_TRIAL)
        for name in parameters:
            if name.startswith(before) and name.endswith(after):
                trial = name[len(before) : len(name) - len(after)]
                said.append(replace(reading, parameter=name, text=reading.text.replace(OF_EACH_TRIAL, trial)))
    return said
