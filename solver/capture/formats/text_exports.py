"""Text that Qualisys', Vicon's and OptiTrack's programs export: which one a file is, by its first lines."""

import csv
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.clock import Clock
from solver.capture.formats.length_units import metres_per_unit
from solver.capture.formats.point_labels import marker_points
from solver.capture.formats.text_table import Row, Text, read_text
from solver.capture.formats.trc import MarkerFile
from solver.capture.marker_cleaning import far_as_nan, unseen_as_nan
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.small_files import kept_while_unchanged

ENDINGS = (".tsv", ".csv", ".txt")
HEAD_BYTES = 100_000  # the longest head: some hundred events, or labels
QTM_KEY = re.compile(r"([A-Z][A-Z0-9_]{3,})[\t;,]")
SECTION = re.compile(
    r"\"?(Trajectories|Devices|Model Outputs|Joints|Segments|Events|Objects|Analog)\"?[\s;,]*", re.IGNORECASE
)


class Program(Enum):
    """What writes such files."""

    QTM = "Qualisys Track Manager"
    NEXUS = "Vicon Nexus"
    MOTIVE = "OptiTrack Motive"


@dataclass(frozen=True)
class Export:
    """What a text file holds, as far as its head and the titles in it tell."""

    program: Program
    markers: bool = False
    forces: bool = False
    kind: str = ""  # the file's own word for what else it holds


def export_of(path: Path) -> Export | None:
    """Which program's text a file is; None for any other file."""
    return _export(path) if path.suffix.lower() in ENDINGS and path.is_file() else None


@kept_while_unchanged(most=4096)
def _export(path: Path) -> Export | None:
    try:
        text = read_text(path, HEAD_BYTES)
        lines = [line.strip() for line in text.lines if line.strip()]
        if lines[0].strip('"').lower().startswith("format version"):
            return Export(Program.MOTIVE, markers=any("position" in line.lower() for line in lines[1:8]))
        if SECTION.fullmatch(lines[0]):
            return _nexus(path)
    except CaptureError:
        return None
    keys = {key[1]: line for line in lines[:500] if (key := QTM_KEY.match(line))}
    if "NO_OF_SAMPLES" in keys and any(key.startswith("FORCE_PLATE") for key in keys):
        return Export(Program.QTM, forces=True)
    if "DATA_INCLUDED" not in keys and "NO_OF_MARKERS" not in keys:
        return None
    kind = (cells_of(keys["DATA_INCLUDED"])[1:] or [""])[0] if "DATA_INCLUDED" in keys else ""
    return Export(Program.QTM, markers="MARKER_NAMES" in keys and kind in ("", "3D"), kind=kind)


def _nexus(path: Path) -> Export:
    text = read_text(path)
    titles = [
        m[1].lower() for line in text.lines if line[:1] not in "0123456789" and (m := SECTION.fullmatch(line))
    ]
    plates = any(
        re.search(r"[\s;,]F[xyz]\b", line)
        for line in text.lines
        if re.match(r"\"?(Frame|Field|Sample)", line, re.IGNORECASE)
    )
    markers = "trajectories" in titles
    return Export(Program.NEXUS, markers=markers, forces=plates, kind=", ".join(dict.fromkeys(titles)))


def cells_of(line: str, separator: str | None = None) -> list[str]:
    """The cells of a line of words, without blanks and quotes; split as the line itself says by default."""
    separator = separator or next((sign for sign in ("\t", ";", ",") if sign in line), ",")
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]


def number_of(cell: str) -> float | None:
    """The number in a cell, with a decimal point or comma."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return None


def table_of(
    path: Path, text: Text, rows: Sequence[Row], width: int
) -> tuple[Float[np.ndarray, "rows columns"], tuple[int, ...], tuple[Note, ...]]:
    """Rows as one table, NaN where there is no number; the line of each; and a note on short ones.

    A line of separators alone is a row on which nothing was seen.

    Args:
        path: for messages.
        text: the file.
        rows: those with numbers.
        width: columns, as far as the head tells; 0 where the widest row tells.

    Raises:
        CaptureError: the last row is cut off, or a row has more numbers than there are columns.
    """
    width = width or max(len(row.values) for row in rows)
    first, last = rows[0].line, rows[-1]
    while first > 1 and (above := text.lines[first - 2]) and not above.strip(" \t;,"):
        first -= 1
    if not text.ends_with_newline and len(last.values) < min(
        [width, *(len(row.values) for row in rows[:-1])]
    ):
        raise CaptureError(
            f"{path}: line {last.line}: the file is cut off inside this row. Copy or export it again; to "
            "work with what is there, delete the row."
        )
    held = {row.line: row.values for row in rows}
    lines = tuple(k for k in range(first, last.line + 1) if k in held or text.lines[k - 1])
    table = np.full((len(lines), width), np.nan)
    short = []
    for i, line in enumerate(lines):
        values = held.get(line, ())
        if len(values) > width and not np.isnan(values[width:]).all():
            raise CaptureError(
                f"{path}: line {line} holds {len(values)} numbers, but there are {width} columns. Export it "
                "again."
            )
        short += [line] * (0 < len(values) < width)
        table[i, : len(values)] = values[:width]
    if not short:
        return table, lines, ()
    return (
        table,
        lines,
        noted(
            Kind.LEFT_OUT,
            f"{path.name}: {len(short)} rows are shorter than the others (first in line {short[0]}); what "
            "belongs at their ends counts as not seen",
        ),
    )


def marker_file(
    path: Path,
    labels: Sequence[str],
    written: Float[np.ndarray, "rows points 3"],
    clock: Clock,
    *,
    units: str | None,
    computed: Collection[str] = (),
) -> MarkerFile:
    """Markers in metres, NaN where not seen, axes as the file has them.

    Args:
        path: the file.
        labels: of the points.
        written: their places in each row, as written.
        clock: where rows lie in time.
        units: of lengths, in the file's word.
        computed: labels that the file says are no markers.

    Raises:
        CaptureError: there is no marker, or the unit cannot be what the file says.
    """
    seen_frames = (np.isfinite(written).all(axis=2) & (written != 0).any(axis=2)).sum(axis=0)
    chosen = marker_points(labels, seen_frames, frozenset(computed), path.name)
    if not chosen.names:
        listed = "; ".join(chosen.notes).replace(f"{path.name}: ", "")
        raise CaptureError(
            f"{path}: the file holds no labelled marker ({listed}). Label them and export again."
        )
    placed = clock.placed(written[:, list(chosen.columns)])
    seen, unseen_notes = unseen_as_nan(placed, chosen.names, path.name)
    scale, unit_notes = metres_per_unit(units, seen, path, "its head")
    near, far_notes = far_as_nan(seen * scale, chosen.names, path.name)
    return MarkerFile(
        Markers(chosen.names, clock.moved(near), clock.rate, clock.start_time),
        (*clock.notes, *chosen.notes, *unit_notes, *unseen_notes, *far_notes),
    )
