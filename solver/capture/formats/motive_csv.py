"""OptiTrack Motive's CSV export of a take: columns with a type, a name, a quantity and an axis each.

Source: docs.optitrack.com, "Data Export: CSV" (format versions 1.2 and later). Of rigid bodies and skeletons
it holds where the software put their markers; `Marker` columns hold what cameras saw, and are what is read.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver.capture.clock import find_clock
from solver.capture.formats.text_exports import cells_of, marker_file, number_of, table_of
from solver.capture.formats.text_table import dialect_of_rows, read_text, rows_of_numbers
from solver.capture.formats.trc import MarkerFile
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

HEAD_LINES = 20
MEASURED, SOLVED = "marker", ("bone marker", "rigid body marker", "marker set marker")
NUMBERED = re.compile(r"(.+):(marker ?\d+)", re.IGNORECASE)  # of a rigid body, whose name tells it apart
UNLABELLED = re.compile(r"(.*:)?unlabell?ed.*", re.IGNORECASE)


@dataclass(frozen=True)
class _Column:
    """Where the x of a trajectory stands, and what it is."""

    place: int
    kind: str
    name: str


def read_motive_markers(path: Path) -> MarkerFile:
    """The markers that cameras saw; where none was exported, those that the software placed.

    Raises:
        CaptureError: it cannot be read, or holds no positions of markers.
    """
    text = read_text(path)
    last = min(HEAD_LINES, len(text.lines))
    axes_line = next((k for k in range(last) if re.match(r"\"?Frame\b", text.lines[k])), None)
    if axes_line is None or axes_line + 1 >= len(text.lines):
        raise CaptureError(f"{path}: no row of data below a line that begins with 'Frame'. Export it again.")
    dialect = dialect_of_rows(text, axes_line + 1)
    separator = dialect.separator or ","
    said = cells_of(text.lines[0], separator)
    stated = dict(zip(said[::2], said[1::2], strict=False))
    head = [cells_of(line, separator) for line in text.lines[1 : axes_line + 1] if line.strip(" \t;,")]
    columns = _columns(head)
    chosen, notes = _chosen(path, columns)
    axes = head[-1]
    rows = rows_of_numbers(path, text, axes_line + 1, dialect, lambda k: _called(columns, axes, k))
    values, lines, row_notes = table_of(path, text, rows, 0)
    width = max(column.place for column in chosen) + 3
    if values.shape[1] < width:
        raise CaptureError(
            f"{path}: rows hold {values.shape[1]} numbers, their names need {width}. Export it again."
        )
    rate = number_of(stated.get("Export Frame Rate", "")) or number_of(stated.get("Capture Frame Rate", ""))
    clock = find_clock(values[:, 1], path=path, lines=lines, header_rate=rate)
    written = np.stack([values[:, column.place : column.place + 3] for column in chosen], axis=1)
    names = [NUMBERED.sub(r"\1_\2", column.name) for column in chosen]
    found = marker_file(path, names, written, clock, units=stated.get("Length Units") or None)
    return MarkerFile(found.markers, (*notes, *row_notes, *found.notes))


def _columns(head: Sequence[Sequence[str]]) -> list[_Column]:
    """The trajectories that are positions, by rows for type, name and quantity above the axes."""
    if len(head) < 4:
        return []
    axes, quantities = head[-1], head[-2]
    kinds = next((row for row in head if row[1:2] == ["Type"]), head[0])
    names = next((row for row in head if row[1:2] == ["Name"]), head[1])
    return [
        _Column(k, kinds[k].lower(), names[k])
        for k in range(2, min(len(axes) - 2, len(kinds), len(names), len(quantities)))
        if [axis.upper() for axis in axes[k : k + 3]] == ["X", "Y", "Z"]
        and quantities[k].lower() == "position"
    ]


def _chosen(path: Path, columns: Sequence[_Column]) -> tuple[list[_Column], tuple[Note, ...]]:
    """The trajectories that are markers of the person, and what else there is."""
    seen = [column for column in columns if column.kind == MEASURED and not UNLABELLED.fullmatch(column.name)]
    placed = [column for column in columns if column.kind in SOLVED]
    bodies = [column for column in columns if column.kind in ("bone", "rigid body")]
    unlabelled = sum(column.kind == MEASURED for column in columns) - len(seen)
    if not seen and not placed:
        held = f"{len(bodies)} rigid bodies or bones, " if bodies else ""
        raise CaptureError(
            f"{path}: no labelled marker, only {held}{unlabelled} unlabelled ones. Label them in Motive and "
            "export with markers."
        )
    parts = [
        (len(placed) if seen else 0, "markers where the software put them, beside those that cameras saw"),
        (len(bodies), "rigid bodies and bones"),
        (unlabelled, "unlabelled markers"),
    ]
    notes = tuple(
        Note(Kind.OTHER, f"{path.name}: left out: {count} {what}") for count, what in parts if count
    )
    if not seen:
        notes += noted(
            Kind.OTHER,
            f"{path.name}: no markers as cameras saw them: those of rigid bodies and bones are used, which "
            "the software smoothed. Export labelled markers for better angles",
        )
    return seen or placed, notes


def _called(columns: Sequence[_Column], axes: Sequence[str], k: int) -> str:
    of = next((column for column in columns if column.place <= k < column.place + 3), None)
    axis = axes[k] if k < len(axes) and axes[k] else str(k + 1)
    return f"{of.name} {axis}" if of else axis
