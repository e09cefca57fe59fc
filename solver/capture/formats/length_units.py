"""Metres from what a marker file says its numbers are, checked against the size of a person."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

METRES_PER_UNIT = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
SPELLINGS = {
    "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres", "[mm]", "(mm)"),
    "cm": ("cm", "centimeter", "centimeters", "centimetre", "centimetres", "[cm]", "(cm)"),
    "m": ("m", "meter", "meters", "metre", "metres", "mete", "[m]", "(m)"),
}


SMALLEST_SPREAD_M = 0.05  # half of what the markers of one foot span: the header's unit is wrong below it
LARGEST_SPREAD_M = 8.0  # twice a wheelchair user with the chair: the header's unit is wrong beyond it
SMALLEST_PERSON_M = 0.3  # a unit that makes the markers span less is not guessed: a leg is longer
LARGEST_PERSON_M = 4.0  # likewise beyond: arms stretched, nobody spans as much


def unit_of(word: str) -> str | None:
    """The unit that a word names: "mm", "cm", "m", or None."""
    return next((unit for unit, words in SPELLINGS.items() if word.strip().lower() in words), None)


def metres_per_unit(
    claimed: str | None,
    positions: Float[np.ndarray, "frames markers 3"],
    path: Path,
    place: str = "its third line",
) -> tuple[float, tuple[Note, ...]]:
    """What to multiply with to get metres, and what had to be assumed.

    Args:
        claimed: the header's word; None where there is none.
        positions: as in the file, NaN where not seen.
        path: for messages.
        place: where the file names its units, for messages.

    Raises:
        CaptureError: the unit is unknown, or contradicts the size of the data and no other one fits a person.
    """
    unit = unit_of(claimed) if claimed is not None else None
    extent = _extent(positions)
    person_m = (SMALLEST_PERSON_M, LARGEST_PERSON_M)
    fitting = [u for u, metres in METRES_PER_UNIT.items() if _within(extent * metres, person_m)]
    if unit is None and claimed is not None:
        raise CaptureError(
            f"{path}: unknown units '{claimed}' in the header. Write one of {', '.join(METRES_PER_UNIT)}."
        )
    if unit is None:
        if len(fitting) != 1:
            raise CaptureError(f"{path}: the header gives no units. Write mm, cm or m into {place}.")
        return METRES_PER_UNIT[fitting[0]], noted(
            Kind.OTHER,
            f"{path.name}: the header gives no units; {fitting[0]} assumed, since the markers then span "
            f"{extent * METRES_PER_UNIT[fitting[0]]:.2f} m",
        )
    metres = METRES_PER_UNIT[unit]
    if np.isnan(extent) or _within(extent * metres, (SMALLEST_SPREAD_M, LARGEST_SPREAD_M)):
        return metres, ()
    if len(fitting) != 1:
        raise CaptureError(
            f"{path}: units '{unit}' in the header, but then the markers span {extent * metres:.4g} m. "
            f"Correct the units in {place}."
        )
    return METRES_PER_UNIT[fitting[0]], noted(
        Kind.OTHER,
        f"{path.name}: the header says {unit}, but then the markers would span {extent * metres:.4g} m; "
        f"read as {fitting[0]} ({extent * METRES_PER_UNIT[fitting[0]]:.2f} m)",
    )


def _extent(positions: Float[np.ndarray, "frames markers 3"]) -> float:
    """Diagonal of the box around the markers in the median frame; NaN unless two are seen together."""
    several = np.isfinite(positions).all(axis=2).sum(axis=1) >= 2
    if not several.any():
        return float("nan")
    seen = positions[several]
    box = np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1)
    return float(np.median(np.linalg.norm(box, axis=1)))


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]
