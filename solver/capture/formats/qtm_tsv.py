"""Qualisys Track Manager's text export: markers in X.tsv; each force plate in a file of its own, X_f_1.tsv.

Source: docs.qualisys.com, "Motion data (.tsv)" and "Force data information": lengths in mm, moments in N·m;
forces act on the plate, whose own z axis points down; corners are named by the signs of their own x and y.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.clock import find_clock
from solver.capture.formats.storage import PlateColumns, Storage
from solver.capture.formats.text_exports import (
    Export,
    Program,
    cells_of,
    export_of,
    marker_file,
    number_of,
    table_of,
)
from solver.capture.formats.text_table import dialect_of_rows, read_text, rows_of_numbers, starts_with_number
from solver.capture.formats.trc import MarkerFile
from solver.capture.plates.force_platform import plate_axes
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

OF_PLATE = re.compile(
    r"(.+)_f(?:_(\d+))?((?: ?\(\d+\)| - \w+)*)", re.IGNORECASE
)  # X_f_1 (2).tsv is of X (2).tsv
CORNERS = ("POSX_POSY", "NEGX_POSY", "NEGX_NEGY", "POSX_NEGY")  # by quadrants, as C3D numbers them
PLATE = Export(Program.QTM, forces=True)
VECTORS = ("FORCE", "MOMENT", "COP")
METRES = 1e-3  # per mm, in which QTM writes all lengths


@dataclass(frozen=True)
class _Table:
    """A file taken apart: its head, and the numbers below."""

    path: Path
    head: Mapping[str, Sequence[str]]
    labels: Sequence[str]  # of columns; empty where the file names none
    values: Float[np.ndarray, "rows columns"]
    lines: Sequence[int]
    notes: tuple[Note, ...]

    @property
    def rate(self) -> float | None:
        """FREQUENCY [Hz], where it is a number."""
        return number_of(self.word("FREQUENCY"))

    def word(self, key: str) -> str:
        """What the head says, or nothing."""
        return next(iter(self.head.get(key, ())), "")

    def leading(self, width: int) -> tuple[int, Float[np.ndarray, " rows"]]:
        """How many columns stand before the data, and the times [s]; NaN without a time column or a rate.

        A frame number rises by one a row, a time by the frame rate; blanks behind the data are trailing tabs.

        Args:
            width: columns of data.
        """
        rate, spare = self.rate or 0.0, self.values.shape[1] - width
        lead = 0
        times = np.full(len(self.values), np.nan)
        named = [label.split()[0].lower() for label in self.labels[:3] if label]
        steps = np.diff(self.values[:, :2], axis=0)
        if spare > 0 and (named[:1] in (["frame"], ["sample"]) or (len(steps) and np.all(steps[:, 0] == 1))):
            lead = 1
        if spare > lead and (named[lead : lead + 1] == ["time"] or _is_clock(steps[:, lead], rate)):
            times = self.values[:, lead]
            lead += 1
        elif rate:
            times = np.arange(len(times)) / rate
        return lead + (named[lead : lead + 1] == ["smpte"]), times


def _is_clock(steps: Float[np.ndarray, " steps"], rate: float) -> bool:
    return bool(len(steps) and rate and np.all(np.abs(steps * rate - 1) < 0.5))


def read_qtm_markers(path: Path) -> MarkerFile:
    """The markers of X.tsv.

    Raises:
        CaptureError: it cannot be read, holds no 3D data, or columns that its head does not explain.
    """
    table = _read(path)
    labels = [label for label in table.head.get("MARKER_NAMES", ()) if label]
    if not labels:
        raise CaptureError(f"{path}: no MARKER_NAMES. Export 3D data with the head.")
    width = 3 * len(labels)
    lead, times = table.leading(width)
    if table.values.shape[1] < lead + width or np.isfinite(table.values[:, lead + width :]).any():
        raise CaptureError(
            f"{path}: MARKER_NAMES holds {len(labels)} names, which need {width} columns, but rows hold "
            f"{table.values.shape[1] - lead}. Export it again."
        )
    clock = find_clock(times, path=path, lines=table.lines, header_rate=table.rate)
    if not np.isfinite(clock.rate):
        raise CaptureError(f"{path}: no time column, and no FREQUENCY: the frame rate is unknown.")
    kinds = table.head.get("TRAJECTORY_TYPES", ())
    virtual = [label for label, kind in zip(labels, kinds, strict=False) if kind.lower() == "virtual"]
    written = table.values[:, lead : lead + width].reshape(len(table.values), len(labels), 3)
    found = marker_file(path, labels, written, clock, units="mm", computed=virtual)
    notes = (*table.notes, *found.notes)
    said = number_of(table.word("NO_OF_FRAMES"))
    if said is not None and said != len(table.values):
        notes += noted(
            Kind.LEFT_OUT, f"{path.name}: the head says {said:g} frames, the file holds {len(table.values)}"
        )
    return MarkerFile(found.markers, notes)


def read_qtm_forces(path: Path) -> Storage:
    """The force plates of a recording, of which the file of any is named, in the laboratory's axes.

    Raises:
        CaptureError: a file cannot be read, or says too little to place its plate.
    """
    tables = [_read(each) for each in force_files(path)]
    rows = min(len(table.values) for table in tables)
    plates: list[PlateColumns] = []
    columns: list[Float[np.ndarray, "rows 3"]] = []
    notes: list[Note] = []
    times = np.full(rows, np.nan)
    for table in tables:
        lead, own_times = table.leading(9)
        if np.isnan(times).all():
            times = own_times[:rows]
        vectors, corners, frame = _in_laboratory(table, lead, rows)
        place = 3 * len(columns)
        named = table.word("FORCE_PLATE_NAME") or f"plate {len(plates) + 1}"
        name = named if all(named != plate.name for plate in plates) else f"{named}#{len(plates) + 1}"
        force, moment, point = ((place + k, place + k + 1, place + k + 2) for k in (0, 3, 6))
        plates.append(PlateColumns(name, force, point, moment, corners))
        columns += vectors
        notes += (Note(Kind.PLATES, f"{table.path.name}: '{name}', in {frame} coordinates"), *table.notes)
    first = tables[0]
    if np.isnan(times).all():
        raise CaptureError(f"{first.path}: no time column, and no FREQUENCY: the rate is unknown.")
    if any(len(table.values) != rows for table in tables):
        notes += noted(
            Kind.OTHER,
            f"{first.path.name}: plates differ in length; read as far as the shortest, {rows} samples",
        )
    labels = tuple(f"{p.name} {v} {a}" for p in plates for v in ("force", "moment", "cop") for a in "xyz")
    rate = (rows - 1) / float(times[-1] - times[0]) if rows > 1 and times[-1] > times[0] else np.nan
    return Storage(
        first.path,
        labels,
        times,
        np.concatenate(columns, axis=1),
        rate,
        lines=tuple(first.lines[:rows]),
        notes=tuple(notes),
        plates=tuple(plates),
    )


def force_files(path: Path) -> tuple[Path, ...]:
    """The files that are read where a file of forces is named: all plates of one export, or it alone."""
    found = OF_PLATE.fullmatch(path.stem)
    if found is None or export_of(path) != PLATE:
        return (path,)
    own = marker_stem(path)
    others = [
        (int(other[2] or 0), each)
        for each in path.parent.iterdir()
        if each.suffix == path.suffix
        and (other := OF_PLATE.fullmatch(each.stem))
        and marker_stem(each) == own
        and export_of(each) == PLATE
    ]
    return tuple(each for _, each in sorted(others))


def plates_beside(path: Path) -> Path | None:
    """The file of the first plate of a marker file's own export, in the same folder; None without one."""
    export = export_of(path)
    if export is None or export.program is not Program.QTM or not export.markers:
        return None
    plates = [p for p in path.parent.glob(f"*{path.suffix}") if marker_stem(p) == path.stem and p != path]
    return force_files(plates[0])[0] if plates and export_of(plates[0]) == PLATE else None


def marker_stem(path: Path) -> str:
    """The name of the markers' file, without its ending, that a plate's file belongs to: X of X_f_1."""
    found = OF_PLATE.fullmatch(path.stem)
    return path.stem if found is None else found[1] + found[3]


def _in_laboratory(
    table: _Table, lead: int, rows: int
) -> tuple[list[Float[np.ndarray, "rows 3"]], Float[np.ndarray, "4 3"] | None, str]:
    """Force [N] and moment [N·m] on the person, centre of pressure [m] or NaN; corners; in which axes."""
    wanted = [f"{vector}_{axis}" for vector in VECTORS for axis in "XYZ"]
    by_name = {label.upper().replace(" ", "_"): k for k, label in enumerate(table.labels)}
    places = [by_name.get(name, lead + k) for k, name in enumerate(wanted)]
    if max(places) >= table.values.shape[1]:
        raise CaptureError(
            f"{table.path}: rows of {table.values.shape[1]} numbers; force, moment and centre of pressure "
            "need nine. Export it again."
        )
    force, moment, point = table.values[:rows, places].reshape(rows, 3, 3).transpose(1, 0, 2)
    force, moment = -force, -moment
    point = np.where((point != 0).any(axis=1, keepdims=True), point, np.nan) * METRES
    numbers = [number_of(table.word(f"FORCE_PLATE_CORNER_{at}_{axis}")) for at in CORNERS for axis in "XYZ"]
    described = table.word("DESCRIPTION").lower()
    known = [number for number in numbers if number is not None]
    corners = np.array(known).reshape(4, 3) * METRES if len(known) == len(numbers) else None
    if corners is not None and not np.ptp(corners, axis=0).any():
        corners = None
    if re.search(r"\b(lab|world|global)", described) and "local" not in described:
        return [force, moment, point], corners, "the laboratory's"
    if corners is None:
        raise CaptureError(
            f"{table.path}: forces in the plate's own coordinates, and no FORCE_PLATE_CORNER says where it "
            "lies. Export it with the head, after the plate's place was set."
        )
    R_lab_plate = plate_axes(corners)
    point_lab = point @ R_lab_plate.T + corners.mean(axis=0)
    return [force @ R_lab_plate.T, moment @ R_lab_plate.T, point_lab], corners, "its own"


def _read(path: Path) -> _Table:
    text = read_text(path)
    first = next((k for k, line in enumerate(text.lines) if starts_with_number(line)), None)
    if first is None:
        raise CaptureError(f"{path}: no row of data after the head. Export the trial again.")
    head = [cells_of(line) for line in text.lines[:first] if line.strip()]
    named = head[-1] if head and re.match(r"(frame|sample|time)\b", head[-1][0], re.IGNORECASE) else []
    events = sum(cells[0] == "EVENT" for cells in head)
    dialect = dialect_of_rows(text, first)
    rows = rows_of_numbers(path, text, first, dialect, lambda k: _column(named, k))
    values, lines, notes = table_of(path, text, rows, 0)
    return _Table(
        path,
        {cells[0]: cells[1:] for cells in head if cells[0] != "EVENT"},
        [label for label in named if label],
        values,
        lines,
        (*notes, *(noted(Kind.LEFT_OUT, f"{path.name}: {events} events are not used") if events else ())),
    )


def _column(labels: Sequence[str], k: int) -> str:
    return labels[k] if k < len(labels) and labels[k] else str(k + 1)
