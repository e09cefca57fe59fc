"""How the parameters of a cause are said: sense, unit and which sign means what."""

from dataclasses import dataclass


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


NOT_TOLD = "this recording does not tell"
ON_SEGMENT = "{distance} from the segment's origin, at {point} in its axes"
