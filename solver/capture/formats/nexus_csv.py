"""Vicon's ASCII export: sections of one file, each with a title, a rate, names, axes, units and rows.

Trajectories are markers; Devices hold force plates and analog channels, several sub-frames a frame.
Workstation and BodyBuilder wrote the same with other words (`60,Hz`, `Field #`).
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.clock import find_clock
from solver.capture.formats.length_units import METRES_PER_UNIT, unit_of
from solver.capture.formats.storage import PlateColumns, Storage
from solver.capture.formats.text_exports import SECTION, cells_of, marker_file, number_of, table_of
from solver.capture.formats.text_table import (
    Text,
    dialect_of_rows,
    read_text,
    rows_of_numbers,
    starts_with_number,
)
from solver.capture.formats.trc import MarkerFile
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted

TRAJECTORIES, DEVICES = "trajectories", ("devices", "analog")
AXES_LINE = re.compile(r"\"?(frame|field|sample)", re.IGNORECASE)
QUANTITIES = {"f": "force", "m": "moment", "c": "cop"}
COMBINED = re.compile(r"combined", re.IGNORECASE)


@dataclass(frozen=True)
class _Section:
    """One section taken apart."""

    path: Path
    title: str
    rate: float  # [Hz]
    names: Sequence[str]  # above each column, as far as its name reaches
    axes: Sequence[str]
    units: Sequence[str]  # empty where there is no such row
    values: Float[np.ndarray, "rows columns"]
    lines: tuple[int, ...]
    notes: tuple[Note, ...]

    @property
    def times(self) -> Float[np.ndarray, " rows"]:
        """Of frame 1 and its sub-frame 0 is 0 s [s]."""
        frames = self.values[:, 0] - 1
        if len(self.axes) < 2 or not self.axes[1].lower().startswith("sub"):
            return frames / self.rate
        sub = self.values[:, 1]
        of_frame = np.nanmax(sub, initial=0.0) + 1
        return (frames * of_frame + sub) / self.rate

    def unit(self, column: int) -> str:
        """What stands in the row of units above a column."""
        return self.units[column] if column < len(self.units) else ""


def read_nexus_markers(path: Path) -> MarkerFile:
    """The trajectories.

    Raises:
        CaptureError: it cannot be read, or has no trajectories.
    """
    sections = list(_sections(path))
    section = next((each for each in sections if each.title == TRAJECTORIES), None)
    if section is None:
        titles = ", ".join(each.title for each in sections)
        raise CaptureError(f"{path}: no Trajectories among its sections ({titles}). Export them with it.")
    columns = [k for k in range(len(section.axes) - 2) if _axes(section, k) == "xyz" and section.names[k]]
    if not columns:
        raise CaptureError(f"{path}: its Trajectories name no marker. Label them and export again.")
    unit = next((section.unit(k) for k in columns if section.unit(k)), "mm")
    clock = find_clock(section.times, path=path, lines=section.lines, header_rate=section.rate)
    written = np.stack([section.values[:, k : k + 3] for k in columns], axis=1)
    found = marker_file(path, [section.names[k] for k in columns], written, clock, units=unit)
    others = [each.title for each in sections if each.title not in (TRAJECTORIES, *DEVICES)]
    notes = noted(Kind.OTHER, f"{path.name}: not used: {', '.join(others)}") if others else ()
    return MarkerFile(found.markers, (*section.notes, *notes, *found.notes))


def read_nexus_forces(path: Path) -> Storage:
    """The force plates among the devices, in the laboratory's axes.

    Raises:
        CaptureError: it cannot be read, or holds no force plate.
    """
    for section in _sections(path):
        plates = _plates(section) if section.title in DEVICES else {}
        if plates:
            break
    else:
        raise CaptureError(f"{path}: no force plate among its devices. Export them with it.")
    used = {name: triples for name, triples in plates.items() if not COMBINED.match(name)} or plates
    columns: list[Float[np.ndarray, "rows 3"]] = []
    found: list[PlateColumns] = []
    notes = list(section.notes)
    for name, triples in used.items():
        place: dict[str, tuple[int, int, int]] = {}
        for quantity, first in triples.items():
            at = 3 * len(columns)
            place[quantity] = (at, at + 1, at + 2)
            columns.append(section.values[:, first : first + 3] * _factor(section, quantity, first))
        found.append(PlateColumns(name, place["force"], place.get("cop"), place.get("moment")))
    if len(used) < len(plates):
        notes += noted(
            Kind.OTHER,
            f"{path.name}: left out, the sum of others: {', '.join(p for p in plates if p not in used)}",
        )
    labels = tuple(f"{p} {q} {a}" for p, triples in used.items() for q in triples for a in "xyz")
    return Storage(
        path,
        labels,
        section.times,
        np.concatenate(columns, axis=1),
        section.rate,
        lines=section.lines,
        notes=tuple(notes),
        plates=tuple(found),
    )


def _plates(section: _Section) -> dict[str, dict[str, int]]:
    """The first column of each plate's force, moment and centre of pressure, by the plate's name."""
    found: dict[str, dict[str, int]] = {}
    for k in range(len(section.axes) - 2):
        axes = [axis.lower() for axis in section.axes[k : k + 3]]
        quantity = QUANTITIES.get(axes[0][:1])
        if quantity and axes == [axes[0][0] + axis for axis in "xyz"]:
            found.setdefault(
                section.names[k].rpartition(" - ")[0].strip() or section.names[k], {}
            ).setdefault(quantity, k)
    return {name: triples for name, triples in found.items() if "force" in triples}


def _factor(section: _Section, quantity: str, column: int) -> float:
    """From the file's unit to N, N·m or m; Nexus writes mm and N·mm where it says nothing."""
    unit = section.unit(column)
    if quantity == "force":
        return 1000.0 if unit.lower() == "kn" else 1.0
    if quantity == "cop":
        return METRES_PER_UNIT[unit_of(unit) or "mm"]
    letters = "".join(sorted(letter for letter in unit.lower() if letter.isalpha()))
    return {"mn": 1.0, "cmn": 1e-2}.get(letters, 1e-3)


def _axes(section: _Section, column: int) -> str:
    return "".join(section.axes[column : column + 3]).lower()


def _sections(path: Path) -> Iterator[_Section]:
    text = read_text(path)
    for k in range(len(text.lines) - 4):
        title = SECTION.fullmatch(text.lines[k]) if text.lines[k][:1] not in "0123456789" else None
        rate = number_of(cells_of(text.lines[k + 1])[0]) if title and text.lines[k + 1] else None
        if title and rate and AXES_LINE.match(text.lines[k + 3]):
            yield _section(path, text, k, title[1].lower(), rate)


def _section(path: Path, text: Text, start: int, title: str, rate: float) -> _Section:
    first = next(
        (k for k in range(start + 4, min(start + 7, len(text.lines))) if starts_with_number(text.lines[k])),
        None,
    )
    if first is None:
        raise CaptureError(f"{path}: line {start + 5}: no row of data in its {title}. Export it again.")
    end = next(
        (k for k in range(first, len(text.lines)) if not text.lines[k].strip(" \t;,")), len(text.lines)
    )
    dialect = dialect_of_rows(text, first, end)
    separator = dialect.separator or ","
    names, axes = (cells_of(text.lines[start + k], separator) for k in (2, 3))
    while axes and not axes[-1]:
        axes.pop()
    reach, name = [], ""
    for k in range(len(axes)):
        name = (names[k] if k < len(names) else "") or name
        reach.append(name)
    rows = rows_of_numbers(
        path,
        text,
        first,
        dialect,
        lambda k: f"{reach[k]} {axes[k]}".strip() if k < len(axes) else str(k + 1),
        end=end,
    )
    values, lines, notes = table_of(path, text, rows, len(axes))
    units = cells_of(text.lines[first - 1], separator) if first > start + 4 else []
    return _Section(path, title, rate, reach, axes, units, values, lines, notes)
