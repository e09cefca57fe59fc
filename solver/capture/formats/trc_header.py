"""The head of a .trc file: what it claims, and which columns its names stand above."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from solver.capture.formats.length_units import unit_of
from solver.capture.formats.text_table import Text
from solver.common.errors import CaptureError

UNITS_PLACE = 4  # of the header's values, where all stand in it
SEARCHED_LINES = 20  # the header has five lines; some programs put remarks before it


@dataclass(frozen=True)
class TrcHeader:
    """What stands above the data.

    `labels` are (place, name): the marker's place in the row, by threes, from 0; marker k's x is in column
    `lead + 3 k`.
    """

    label_line: int  # index of the line of names
    labels: tuple[tuple[int, str], ...]
    aligned: bool  # names stand above their columns; otherwise they only come in the same order
    lead: int  # columns before the first marker
    time_column: int | None
    rate: float | None = None  # [Hz]
    frames: int | None = None
    markers: int | None = None
    units: str | None = None


def read_header(path: Path, text: Text) -> TrcHeader:
    """Find the line of marker names and the header's claims, however many of them there are.

    Raises:
        CaptureError: there is no line of names.
    """
    label_line = next(
        (k for k, x in enumerate(text.lines[:SEARCHED_LINES]) if re.match(r"[\s#]*(frame|time)", x, re.I)),
        None,
    )
    if label_line is None:
        raise CaptureError(
            f"{path}: no line of marker names (it begins with 'Frame#' and 'Time') in the first "
            f"{min(len(text.lines), SEARCHED_LINES)} lines: the file is cut off, or not a .trc file. "
            "Export it again."
        )
    lead, time_column, aligned, labels = _labels(text.lines[label_line])
    rate, frames, markers, units = _claims(text.lines[:label_line])
    return TrcHeader(label_line, labels, aligned, lead, time_column, rate, frames, markers, units)


def _labels(line: str) -> tuple[int, int | None, bool, tuple[tuple[int, str], ...]]:
    """Columns before the first marker, the time's column, whether names are aligned, and their places.

    Names stand above the x column of their marker, or, when some program wrote fewer tabs, just in order.
    """
    separator = next((sign for sign in ("\t", ";", ",") if sign in line), None)
    cells = [cell.strip() for cell in line.split(separator)]
    if separator == "\t" and " " in cells[0]:  # "Frame# Time" with a blank between
        cells = [*cells[0].split(), *cells[1:]]
    lead = 0
    time_column = None
    while lead < len(cells) and lead < 2 and re.match(r"#?(frame|time)", cells[lead], re.IGNORECASE):
        if cells[lead].lower().startswith("time"):
            time_column = lead
        lead += 1
    found = [(k, name) for k, name in enumerate(cells[lead:]) if name]
    if separator is not None and all(k % 3 == 0 for k, _ in found):
        return lead, time_column, True, tuple((k // 3, name) for k, name in found)
    return lead, time_column, False, tuple(enumerate(name for _, name in found))


def _claims(lines: Sequence[str]) -> tuple[float | None, int | None, int | None, str | None]:
    """Rate, frames, markers and units: the counts stand before the units, since some leave a rate out."""
    for keys, values in pairwise(lines):
        if "datarate" not in keys.lower():
            continue
        cells = [cell for cell in re.split(r"[\s;,]+", values.strip()) if cell]
        place = next((k for k, cell in enumerate(cells) if unit_of(cell)), None)
        if place is None:
            place = next((k for k, cell in enumerate(cells) if not _is_number(cell)), None)
        before = cells[: UNITS_PLACE if place is None else place]
        rate = float(before[0]) if before and _is_number(before[0]) and float(before[0]) > 0 else None
        counted = [float(cell) for cell in before[1:] if _is_number(cell)]
        counts = [int(number) for number in counted[-2:]]
        frames, markers = counts if len(counts) == 2 else (None, None)
        return rate, frames, markers, cells[place] if place is not None else None
    return None, None, None, None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
