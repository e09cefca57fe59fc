"""Force plates as Cortex and EVaRT of Motion Analysis write them beside a TRC: X.forces.

Force [N] on the person and centre of pressure [mm] in the axes of the TRC, and the free moment about the
vertical [N·mm], which is called MZ whichever axis points up. Sample 1 is at the TRC's first frame.
"""

import re
from pathlib import Path

import numpy as np

from solver.capture.formats.storage import PlateColumns, Storage
from solver.capture.formats.text_exports import table_of
from solver.capture.formats.text_table import dialect_of_rows, read_text, rows_of_numbers, starts_with_number
from solver.common.errors import CaptureError

ENDING = ".forces"
PARTS = ("FX", "FY", "FZ", "X", "Y", "Z", "MZ")
PER_MM = 1e-3


def read_cortex_forces(path: Path) -> Storage:
    """The plates of a .forces file: N, m and N·m.

    Raises:
        CaptureError: it cannot be read, or says neither the rate nor which column is what.
    """
    text = read_text(path)
    first = next((k for k, line in enumerate(text.lines) if starts_with_number(line)), None)
    head = "\n".join(text.lines[:first])
    stated = re.search(r"^\s*SampleRate\s*=\s*([\d.]+)", head, re.IGNORECASE | re.MULTILINE)
    if first is None or stated is None or not float(stated[1]):
        raise CaptureError(f"{path}: no SampleRate, or no row of data below it. Export the forces again.")
    labels = [label.upper() for label in text.lines[first - 1].split()]
    numbers = [label[2:] for label in labels if re.fullmatch(r"FX\d+", label)]
    missing = [f"{part}{n}" for n in numbers for part in PARTS if f"{part}{n}" not in labels]
    if missing or not numbers:
        raise CaptureError(
            f"{path}: line {first}: no column {', '.join(missing) or 'FX1'}. Export force, centre of "
            "pressure and moment of each plate."
        )
    rows = rows_of_numbers(path, text, first, dialect_of_rows(text, first), lambda k: labels[k])
    table, lines, notes = table_of(path, text, rows, len(labels))
    columns = [[labels.index(f"{part}{n}") for part in PARTS] for n in numbers]
    parts = table[:, columns]
    force, point = parts[..., :3], parts[..., 3:6] * PER_MM
    moment = np.zeros_like(force)
    moment[..., np.nansum(np.abs(force), axis=(0, 1)).argmax()] = parts[..., 6] * PER_MM
    rate, width = float(stated[1]), 9 * len(numbers)
    place = [tuple(range(k, k + 3)) for k in range(0, width, 3)]
    return Storage(
        path,
        tuple(f"{n} {of} {a}" for n in numbers for of in ("force", "cop", "moment") for a in "xyz"),
        np.arange(len(table)) / rate,
        np.stack([force, point, moment], axis=2).reshape(len(table), width),
        rate,
        lines=lines,
        notes=notes,
        plates=tuple(
            PlateColumns(f"plate {n}", *place[3 * k : 3 * k + 3])  # type: ignore[arg-type]
            for k, n in enumerate(numbers)
        ),
    )
