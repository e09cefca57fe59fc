"""Tables over time in .mot and .sto files, with every header they come with; as OpenSim reads them back."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.atomic import write_whole
from solver.capture.clock import find_clock
from solver.capture.formats.text_table import (
    Dialect,
    Row,
    Text,
    dialect_of,
    number_repeats,
    read_text,
    rows_of_numbers,
    starts_with_number,
    unique_names,
)
from solver.capture.subject.measured_files import MARK
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

HEAD_BYTES = 1_000_000  # header, names and some rows of the widest table
TIME_LABEL = re.compile(r"time.*|t|t ?[(\[]s[)\]]", re.IGNORECASE)
# No joint turns by more than a whole turn, and the heading only where somebody walks in circles: if two
# columns go beyond this many radians the file is in degrees.
RADIANS_AT_MOST = 2 * np.pi


@dataclass(frozen=True)
class PlateColumns:
    """Column indices (x, y, z) of one plate; None where the file has no such columns."""

    name: str  # the force columns' own prefix
    force: tuple[int, int, int]
    point: tuple[int, int, int] | None
    moment: tuple[int | None, int, int | None] | None  # x and z are None where only the vertical one is given
    corners: Float[np.ndarray, "4 3"] | None = None  # [m] in the table's axes


@dataclass(frozen=True)
class Storage:
    """One table: a column of time and others, as the file has them (units, axes, NaN where blank)."""

    path: Path
    labels: tuple[str, ...]  # without time
    times: Float[np.ndarray, " rows"]  # [s] as printed
    values: Float[np.ndarray, "rows columns"]
    rate: float  # [Hz] samples over duration; NaN for one row
    in_degrees: bool | None = None  # None: the header doesn't say
    name: str = ""  # the header's own title
    lines: tuple[int, ...] = ()  # line number of each row, for messages
    notes: tuple[Note, ...] = ()
    plates: tuple[PlateColumns, ...] = ()  # where the file itself says which columns are whose

    def column(self, label: str) -> Float[np.ndarray, " rows"]:
        """Values of one column.

        Raises:
            CaptureError: there is no such column.
        """
        if label not in self.labels:
            raise CaptureError(
                f"{self.path}: column '{label}' missing; there are {', '.join(self.labels[:60])}."
            )
        return self.values[:, self.labels.index(label)]


def read_storage(path: Path) -> Storage:
    """Read a .mot or .sto file.

    Raises:
        CaptureError: the file is empty or cut off before its first row, has no time column, holds letters
            where a number belongs, or rows that don't fit its columns.
    """
    path = Path(path)
    text = read_text(path)
    label_line, notes = _label_line(path, text)
    head = text.lines[:label_line]
    first = next((k for k in range(label_line + 1, len(text.lines)) if text.lines[k].strip()), None)
    if first is None:
        raise CaptureError(f"{path}: no row of data after the column names. Export the trial again.")
    if re.search(r"datatype\s*=\s*(?!double)", "\n".join(head), re.IGNORECASE):
        raise CaptureError(
            f"{path}: only tables of plain numbers (DataType=double) can be read. Export those."
        )

    labels, unnamed = _split_labels(text.lines[label_line])
    unique, repeated_notes = number_repeats(labels, path.name, "column")
    if unnamed:
        notes += noted(
            Kind.OTHER, f"{path.name}: {unnamed} columns without a name are called column_N by their place"
        )
    notes += repeated_notes
    dialect = dialect_of(text.lines[first])
    rows = rows_of_numbers(
        path,
        text,
        first,
        dialect,
        lambda k: unique[k] if k < len(unique) else f"number {k + 1}, without a name",
    )
    _require_whole_rows(path, text, rows, dialect, unique)
    time_column = next((k for k, label in enumerate(unique) if TIME_LABEL.fullmatch(label)), None)
    if time_column is None:
        raise CaptureError(
            f"{path}: no column 'time' among {', '.join(unique[:12])}. Export with a time column."
        )

    table = np.array([row.values[: len(unique)] for row in rows])
    times = table[:, time_column]
    lines = tuple(row.line for row in rows)
    rate, clock_notes = _rate(path, times, lines)
    blanks = int(np.isnan(table).sum())
    if blanks:
        notes += noted(Kind.LEFT_OUT, f"{path.name}: {blanks} values are blank or NaN")
    return Storage(
        path=path,
        labels=tuple(label for k, label in enumerate(unique) if k != time_column),
        times=times,
        values=np.delete(table, time_column, axis=1),
        rate=rate,
        in_degrees=_in_degrees(head),
        name=_title(head),
        lines=lines,
        notes=(*notes, *_count_notes(path.name, head, len(rows), len(unique)), *clock_notes),
    )


def read_columns(path: Path) -> Storage:
    """The column names of a .mot or .sto file, without its numbers.

    Raises:
        CaptureError: the file is empty, or has no line of names.
    """
    path = Path(path)
    text = read_text(path, HEAD_BYTES)
    labels, _ = _split_labels(text.lines[_label_line(path, text)[0]])
    names = tuple(label for label in unique_names(labels)[0] if not TIME_LABEL.fullmatch(label))
    return Storage(path, names, np.zeros(0), np.zeros((0, len(names))), np.nan)


def write_storage(
    path: Path,
    labels: Sequence[str],
    times: Float[np.ndarray, " rows"],
    values: Float[np.ndarray, "rows columns"],
    *,
    in_degrees: bool = False,
    name: str = "",
) -> None:
    """Write a .mot or .sto file that OpenSim 4.6 reads; whole or not at all.

    Args:
        path: the file; its folder must exist.
        labels: of the columns after time.
        times: [s].
        values: one row a time.
        in_degrees: whether angles in it are degrees.
        name: title in the first line; the file's name if empty.

    Raises:
        CaptureError: the file cannot be written.
        ValueError: the shapes don't fit.
    """
    if values.shape != (len(times), len(labels)):
        raise ValueError(f"values {values.shape} for {len(times)} times and {len(labels)} labels")
    lines = [
        name or Path(path).stem,
        "version=1",
        f"nRows={len(times)}",
        f"nColumns={len(labels) + 1}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        f"software={MARK}",
        "endheader",
        "\t".join(["time", *labels]),
    ]
    lines += [
        "\t".join(f"{value:.12g}" for value in row) for row in np.column_stack([times, values]).tolist()
    ]
    write_whole(path, "\n".join(lines) + "\n")


def _label_line(path: Path, text: Text) -> tuple[int, tuple[Note, ...]]:
    """Index of the line of column names."""
    end = next(
        (k for k, line in enumerate(text.lines) if re.match(r"\s*endheader\b", line, re.IGNORECASE)), None
    )
    notes: tuple[Note, ...] = ()
    if end is None:
        found = next((k for k, line in enumerate(text.lines) if _looks_like_labels(text.lines, k)), None)
        if found is None:
            raise CaptureError(
                f"{path}: neither 'endheader' nor a line of column names that begins with 'time': the file "
                "is cut off, or not a .mot or .sto file. Export it again."
            )
        return found, noted(
            Kind.OTHER, f"{path.name}: no 'endheader'; the column names were found in line {found + 1}"
        )
    found = next((k for k in range(end + 1, len(text.lines)) if text.lines[k].strip()), None)
    if found is None:
        raise CaptureError(f"{path}: nothing follows the header: the file is cut off. Export it again.")
    if starts_with_number(text.lines[found]):
        raise CaptureError(
            f"{path}: line {found + 1}: numbers where the column names belong. Add the line that begins with "
            "'time'."
        )
    return found, notes


def _looks_like_labels(lines: Sequence[str], index: int) -> bool:
    following = next((line for line in lines[index + 1 :] if line.strip()), "")
    labels = _split_labels(lines[index])[0]
    return len(labels) > 1 and any(TIME_LABEL.fullmatch(x) for x in labels) and starts_with_number(following)


def _split_labels(line: str) -> tuple[list[str], int]:
    """Column names, and how many had none."""
    separator = next((sign for sign in ("\t", ";", ",") if sign in line), None)
    cells = [cell.strip() for cell in line.split(separator)]
    while cells and not cells[-1]:
        cells.pop()
    unnamed = sum(not cell for cell in cells)
    return [cell or f"column_{k + 1}" for k, cell in enumerate(cells)], unnamed


def _require_whole_rows(
    path: Path, text: Text, rows: list[Row], dialect: Dialect, labels: Sequence[str]
) -> None:
    """Refuse rows that do not have a number for each column."""
    if not text.ends_with_newline and len(rows[-1].values) < len(labels):
        raise CaptureError(
            f"{path}: line {rows[-1].line}: the file is cut off inside this row. Copy or export it again; to "
            "work with what is there, delete the row."
        )
    for row in rows:
        written = len(row.values)
        while written > len(labels) and np.isnan(row.values[written - 1]):
            written -= 1
        if written != len(labels):
            blanks = " (blanks inside column names?)" if dialect.separator is None else ""
            raise CaptureError(
                f"{path}: line {row.line} holds {written} numbers, but there are {len(labels)} "
                f"columns{blanks}. Is the file cut off? Export it again."
            )


def _rate(
    path: Path, times: Float[np.ndarray, " rows"], lines: Sequence[int]
) -> tuple[float, tuple[Note, ...]]:
    try:
        clock = find_clock(times, path=path, lines=lines)
    except CaptureError as irregular:
        steps = np.diff(times)
        if not np.isfinite(times).all() or steps.min() < 0 or steps.max() <= 0:
            raise
        mean_rate = (len(times) - 1) / float(times[-1] - times[0])
        return mean_rate, noted(Kind.OTHER, str(irregular).replace(str(path), path.name))
    return clock.rate, clock.notes


def _in_degrees(head: Sequence[str]) -> bool | None:
    for line in head:
        match = re.match(r"\s*inDegrees\s*[=: ]\s*(\w+)", line, re.IGNORECASE)
        if match and match[1].lower() in ("yes", "no", "true", "false", "1", "0"):
            return match[1].lower() in ("yes", "true", "1")
    return None


def _title(head: Sequence[str]) -> str:
    for line in head:
        match = re.match(r"\s*name\s+(.*\S)", line, re.IGNORECASE)
        if match:
            return match[1]
    first = head[0].strip() if head else ""
    return "" if re.match(r"\w+\s*=|datacolumns|datarows|range|endheader", first, re.IGNORECASE) else first


def _count_notes(source: str, head: Sequence[str], rows: int, columns: int) -> tuple[Note, ...]:
    notes: tuple[Note, ...] = ()
    for pattern, found, what in (
        (r"(nrows|datarows)", rows, "rows"),
        (r"(ncolumns|datacolumns)", columns, "columns"),
    ):
        for line in head:
            match = re.match(rf"\s*{pattern}\s*[=: ]\s*(\d+)", line, re.IGNORECASE)
            if match and int(match[2]) != found:
                cut = "; is the file cut off?" if what == "rows" and int(match[2]) > found else ""
                text = f"{source}: the header says {match[2]} {what}, the file holds {found}{cut}"
                notes += noted(Kind.NOT_READ if cut else Kind.LEFT_OUT, text)
    return notes


@dataclass(frozen=True)
class Coordinates:
    """Generalized coordinates over time: radians and metres."""

    names: tuple[str, ...]
    values: Float[np.ndarray, "rows coordinates"]  # [rad or m]
    times: Float[np.ndarray, " rows"]  # [s]
    notes: tuple[Note, ...] = ()


def coordinates_from_storage(storage: Storage, rotational: Collection[str]) -> Coordinates:
    """Coordinates in radians and metres from a table of inverse kinematics.

    Args:
        storage: a column for each coordinate.
        rotational: the coordinates that are angles in the file's units. In OpenSim's files these are the
            ones of motion type "rotational" only; coupled ones, such as `knee_angle_r_beta`, stay in radians.
    """
    columns = [k for k, label in enumerate(storage.labels) if label in rotational]
    in_degrees, notes = storage.in_degrees, storage.notes
    if in_degrees is None:
        in_degrees, note = _looks_like_degrees(storage.values[:, columns], storage.path.name)
        notes = (*notes, note)
    values = storage.values.copy()
    if in_degrees:
        values[:, columns] = np.radians(values[:, columns])
    return Coordinates(storage.labels, values, storage.times, notes)


def write_coordinates(
    path: Path,
    names: Sequence[str],
    times: Float[np.ndarray, " rows"],
    values: Float[np.ndarray, "rows coordinates"],
    *,
    rotational: Collection[str],
    in_degrees: bool = True,
) -> None:
    """Write coordinates [rad or m] as OpenSim's tools expect them.

    Args:
        path: the .mot file.
        names: of the coordinates.
        times: [s].
        values: [rad or m].
        rotational: which ones turn into degrees.
        in_degrees: whether they do.

    Raises:
        CaptureError: the file cannot be written.
    """
    scale = np.array([180 / np.pi if in_degrees and name in rotational else 1.0 for name in names])
    write_storage(path, names, times, values * scale, in_degrees=in_degrees, name="Coordinates")


def _looks_like_degrees(angles: Float[np.ndarray, "rows angles"], source: str) -> tuple[bool, Note]:
    largest = np.sort(np.nanmax(np.abs(angles), axis=0, initial=0.0))
    second = float(largest[-2:].min(initial=np.inf)) if len(largest) else 0.0
    in_degrees = second > RADIANS_AT_MOST
    return in_degrees, Note(
        Kind.OTHER,
        f"{source}: the header doesn't say whether angles are degrees; "
        f"{'degrees' if in_degrees else 'radians'} assumed, since the second largest reaches {second:.3g}",
    )
