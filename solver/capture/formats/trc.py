"""Marker trajectories in .trc files, as many programs write them; and as OpenSim reads them back."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.atomic import write_whole
from solver.capture.capture import Markers
from solver.capture.clock import find_clock
from solver.capture.formats.length_units import METRES_PER_UNIT, metres_per_unit, unit_of
from solver.capture.formats.text_table import (
    Text,
    dialect_of,
    number_repeats,
    read_text,
    rows_of_numbers,
    starts_with_number,
)
from solver.capture.marker_cleaning import far_as_nan, unseen_as_nan
from solver.capture.subject.measured_files import MARK
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

UNITS_PLACE = 4  # of the header's values, where all stand in it
SEARCHED_LINES = 20  # the header has five lines; some programs put remarks before it


@dataclass(frozen=True)
class MarkerFile:
    """The markers of one file, and what was assumed, renamed or ignored on the way in."""

    markers: Markers
    notes: tuple[Note, ...] = ()


def read_trc(path: Path) -> MarkerFile:
    """Read a .trc file: metres, NaN where a marker was not seen, axes as the file has them.

    Raises:
        CaptureError: the file is empty, cut off before its first row, or written so that a position would be
            a guess.
    """
    path = Path(path)
    text = read_text(path)
    header = read_header(path, text)
    table, lines, row_notes = _table(path, text, header)
    del text  # of a long recording as large as its numbers
    names, columns, name_notes = _markers(path, header, table)
    times = table[:, header.time_column] if header.time_column is not None else np.full(len(table), np.nan)
    clock = find_clock(times, path=path, lines=lines, header_rate=header.rate)
    if not math.isfinite(clock.rate):
        raise CaptureError(f"{path}: one row and no DataRate in the header: the frame rate is unknown.")

    written = clock.placed(np.stack([table[:, column : column + 3] for column in columns], axis=1))
    seen, unseen_notes = unseen_as_nan(written, names, path.name)
    scale, unit_notes = metres_per_unit(header.units, seen, path)
    near, far_notes = far_as_nan(seen * scale, names, path.name)
    notes = (
        *_count_notes(path.name, header, len(table), len(names)),
        *clock.notes,
        *(row_notes + name_notes + unit_notes + unseen_notes + far_notes),
    )
    return MarkerFile(Markers(names, clock.moved(near), clock.rate, clock.start_time), notes)


def write_trc(path: Path, markers: Markers, units: str = "mm") -> None:
    """Write a .trc file that OpenSim 4.6 reads; frames where a marker was not seen read NaN.

    Args:
        path: the file; its folder must exist.
        markers: positions [m].
        units: "mm", "cm" or "m".

    Raises:
        CaptureError: unknown units, or the file cannot be written.
    """
    if units not in METRES_PER_UNIT:
        raise CaptureError(f"{path}: unknown units '{units}'; choose one of {', '.join(METRES_PER_UNIT)}.")
    rate = f"{markers.rate:.12g}"
    count = len(markers.names)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{Path(path).name}\t{MARK}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{markers.frames}\t{count}\t{units}\t{rate}\t1\t{markers.frames}",
        "Frame#\tTime\t" + "\t\t\t".join(markers.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, count + 1) for axis in "XYZ"),
        "",
    ]
    values = markers.positions_ground.reshape(markers.frames, -1) / METRES_PER_UNIT[units]
    for frame, (time, row) in enumerate(zip(markers.times, values, strict=True)):
        cells = ("NaN" if math.isnan(value) else f"{value:.10g}" for value in row)
        lines.append(f"{frame + 1}\t{time:.9f}\t" + "\t".join(cells))
    write_whole(path, "\n".join(lines) + "\n")


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


def _table(
    path: Path, text: Text, header: TrcHeader
) -> tuple[Float[np.ndarray, "rows columns"], list[int], tuple[Note, ...]]:
    """All numbers below the header, NaN where blank; the line of each row; what was left out."""
    first = _first_row(path, text, header)
    dialect = dialect_of(text.lines[first])
    rows = rows_of_numbers(path, text, first, dialect, lambda column: _column_name(header, column))
    widths = [len(row.values) for row in rows]
    expected = header.lead + 3 * (header.labels[-1][0] + 1) if header.labels else max(widths)
    notes: tuple[Note, ...] = ()
    if not text.ends_with_newline and widths[-1] < min([*widths[:-1], expected]):
        raise CaptureError(
            f"{path}: line {rows[-1].line}: the file is cut off inside this row. Copy or export it again; to "
            "work with what is there, delete the row."
        )
    if not header.aligned and max(widths) < expected:
        raise CaptureError(
            f"{path}: line {header.label_line + 1} holds {len(header.labels)} names, but rows of "
            f"{max(widths)} numbers have room for {(max(widths) - header.lead) // 3}. Export the trial again."
        )
    short = [row for row, width in zip(rows, widths, strict=True) if width < expected]
    if short and dialect.separator is None:
        raise CaptureError(
            f"{path}: line {short[0].line} holds {len(short[0].values)} numbers, but the names need "
            f"{expected}; with blanks as separators, a missing marker cannot be located. Export with tabs, "
            "or with NaN."
        )
    if short:
        notes += noted(
            Kind.OTHER,
            f"{path.name}: {len(short)} rows are shorter than the names require (first in line "
            f"{short[0].line}); the markers at their ends count as not seen",
        )
    table = np.full((len(rows), max(expected, *widths)), np.nan)
    for i, row in enumerate(rows):
        table[i, : len(row.values)] = row.values
    if header.time_column == 1 and np.isnan(table[:, 0]).all() and (np.diff(table[:, 1]) == 1).all():
        table = table[:, 1:]  # rows begin with a tab before the frame number
    return table, [row.line for row in rows], notes


def _first_row(path: Path, text: Text, header: TrcHeader) -> int:
    for index in range(header.label_line + 1, len(text.lines)):
        line = text.lines[index]
        if starts_with_number(line):
            return index
        if not all(re.fullmatch(r"[XYZxyz]\d*", cell) for cell in re.split(r"[\s;,]+", line.strip()) if cell):
            raise CaptureError(
                f"{path}: line {index + 1}: '{line.strip()[:40]}' where the first row of data belongs; "
                "a row begins with the frame number and the time."
            )
    raise CaptureError(f"{path}: no row of data after the header. Export the trial again.")


def _column_name(header: TrcHeader, column: int) -> str:
    if column < header.lead:
        return "Time" if column == header.time_column else "Frame#"
    place, axis = divmod(column - header.lead, 3)
    return f"{dict(header.labels).get(place, f'marker {place + 1}, unnamed')} {'XYZ'[axis]}"


def _markers(
    path: Path, header: TrcHeader, table: Float[np.ndarray, "rows columns"]
) -> tuple[tuple[str, ...], list[int], tuple[Note, ...]]:
    """Names of the markers, the column of each one's x, and which were renamed or have no name."""
    used = np.flatnonzero(np.isfinite(table).any(axis=0))
    places = set((used[used >= header.lead] - header.lead) // 3)
    if not header.labels:
        found = f"; the rows hold {len(places)} markers without a name" if places else ""
        raise CaptureError(
            f"{path}: line {header.label_line + 1} names no marker{found}. Label them and export again."
        )
    notes: tuple[Note, ...] = ()
    unnamed = sorted(int(place) + 1 for place in places - {place for place, _ in header.labels})
    if unnamed and not header.aligned:
        raise CaptureError(
            f"{path}: line {header.label_line + 1} holds {len(header.labels)} names, the rows "
            f"{max(places) + 1} markers: which is which? Name every marker, or put two tabs after each."
        )
    if unnamed:
        listed = ", ".join(str(place) for place in unnamed[:12]) + (", …" if len(unnamed) > 12 else "")
        notes += noted(
            Kind.OTHER, f"{path.name}: {len(unnamed)} markers without a name are ignored, in place {listed}"
        )
    names, repeated_notes = number_repeats([name for _, name in header.labels], path.name)
    return names, [header.lead + 3 * place for place, _ in header.labels], notes + repeated_notes


def _count_notes(source: str, header: TrcHeader, rows: int, markers: int) -> tuple[Note, ...]:
    notes: tuple[Note, ...] = ()
    if header.frames is not None and header.frames != rows:
        cut = "; is the file cut off?" if header.frames > rows else ""
        kind = Kind.NOT_READ if cut else Kind.LEFT_OUT
        notes += noted(kind, f"{source}: the header says {header.frames} frames, the file holds {rows}{cut}")
    if header.markers is not None and header.markers != markers:
        notes += noted(
            Kind.OTHER, f"{source}: the header says {header.markers} markers, the line of names {markers}"
        )
    return notes


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
    if separator == "\t" and sum(map(bool, cells)) < 4:  # names in columns of one width
        cells = re.split(r" *\t *| {2,}", line.strip())
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
