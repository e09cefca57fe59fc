"""What one release has otherwise than another: subjects, trials, reasons, and numbers beyond a tolerance.

Machines of another kind give other last digits: within the tolerances two releases are the same.
"""

import filecmp
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from addb_viewer.dataset.check.findings import Finding, Level, error, warning
from addb_viewer.dataset.columns import Column, Table
from addb_viewer.dataset.identifiers import file_name_of
from addb_viewer.dataset.reader import read_manifest
from addb_viewer.dataset.release_tables import COORDINATES, LEFT_OUT, SUBJECT_TABLES, SUBJECTS, TRIALS

CHECK = "against"
TOLERANCES = {
    "m": 1e-4,
    "rad": 1e-4,
    "rad or m": 1e-4,
    "1": 1e-4,
    "m/s": 1e-3,
    "rad/s": 1e-2,
    "rad/s or m/s": 1e-2,
    "m/s^2": 0.05,
    "rad/s^2": 0.5,
    "rad/s^2 or m/s^2": 0.5,
    "N": 0.1,
    "N*m": 0.02,
    "N*m or N": 0.1,
}
"""By unit. Forces, torques and places as `forces` and `torques` allow them."""
SHARE = 1e-4  # of the larger value, on top; alone for other units
SHARED = (SUBJECTS, TRIALS, COORDINATES)  # tables of the whole release that are compared row by row
NOT_CONTENT = ("_first_row", "_rows", "fit_key")  # ends of columns that say where rows lie, or from what


def differences(release: Path, other: Path) -> list[Finding]:
    """What a release has otherwise than another: numbers as errors, what came and went as warnings.

    Args:
        release: folder of the one.
        other: folder of the one that it is held against.

    Raises:
        ReleaseError: a folder is no release.
    """
    now, before = read_manifest(release), read_manifest(other)
    found = [*_made_with(now, before), *_came_and_went(now, before), *_reasons(release, other)]
    for table in SHARED:
        found += _rows(table, *(pq.read_table(place / table.path) for place in (release, other)))
    for subject in sorted(set(now["subjects"]) & set(before["subjects"])):
        stem = file_name_of(subject)
        for table in SUBJECT_TABLES:
            one, there = (place / table.file(stem) for place in (release, other))
            if not filecmp.cmp(one, there, shallow=False):
                found += _rows(table, pq.read_table(one), pq.read_table(there))
    return sorted(found, key=lambda one: (one.level is not Level.ERROR, one.where, one.said))


def _made_with(now: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[Finding]:
    """Programs, machine and options."""
    for key in ("created_with", "options", "filter", "segments"):
        for name in sorted({*now[key], *before[key]}):
            one, other = now[key].get(name), before[key].get(name)
            if one != other:
                yield warning(CHECK, "manifest.json", f"{key} {name} is {one}, there {other}")
    if now["machine"] != before["machine"]:
        yield warning(CHECK, "manifest.json", f"machine is {now['machine']}, there {before['machine']}")


def _came_and_went(now: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[Finding]:
    """Subjects and trials, and subjects whose files or settings are others."""
    mine, theirs = now["subjects"], before["subjects"]
    for subject in sorted(set(mine) - set(theirs)):
        yield warning(CHECK, subject, f"is new, {mine[subject]['frames']} frames")
    for subject in sorted(set(theirs) - set(mine)):
        yield warning(CHECK, subject, f"is gone, {theirs[subject]['frames']} frames")
    for subject in sorted(set(mine) & set(theirs)):
        one, other = mine[subject], theirs[subject]
        for trial in sorted(set(one["trials"]) - set(other["trials"])):
            yield warning(CHECK, trial, "is new")
        for trial in sorted(set(other["trials"]) - set(one["trials"])):
            yield warning(CHECK, trial, "is gone")
        if one["settings"] != other["settings"]:
            yield warning(CHECK, subject, "was fitted with other settings")
        inputs = {*one["inputs"].items()} ^ {*other["inputs"].items()}
        if inputs:
            yield warning(
                CHECK, subject, f"was made from other files: {', '.join(sorted({p for p, _ in inputs}))}"
            )


def _reasons(release: Path, other: Path) -> Iterator[Finding]:
    """What is left out for another reason, or was not or is not left out."""
    mine, theirs = (_left_out(place) for place in (release, other))
    for key in sorted(set(mine) | set(theirs)):
        one, there = mine.get(key, "not left out"), theirs.get(key, "not left out")
        if one != there:
            yield warning(CHECK, key, f"{one}, there {there}")


def _left_out(release: Path) -> dict[str, str]:
    rows: dict[str, list[str]] = {}
    for row in pq.read_table(release / LEFT_OUT.path).to_pylist():
        rows.setdefault(f"{row['level']} {row['id']}", []).append(row["reason"])
    return {key: ", ".join(sorted(reasons)) for key, reasons in rows.items()}


def _rows(table: Table, mine: pa.Table, theirs: pa.Table) -> Iterator[Finding]:
    """A table of both, trial by trial or subject by subject; what is in one alone was told already."""
    owner = "trial_id" if "trial_id" in table.key else "subject_id"
    for name in sorted(set(mine[owner].unique().to_pylist()) & set(theirs[owner].unique().to_pylist())):
        one, other = (rows.filter(pc.equal(rows[owner], name)) for rows in (mine, theirs))
        if any(one[key].to_pylist() != other[key].to_pylist() for key in table.key):
            yield error(
                CHECK, name, f"{table.name} has {one.num_rows} rows, there {other.num_rows}, or other keys"
            )
            continue
        yield from _columns(table, name, one, other)


def _columns(table: Table, name: str, one: pa.Table, other: pa.Table) -> Iterator[Finding]:
    """The worst column by its tolerance, and how many others are beyond theirs."""
    worst: list[tuple[float, str]] = []
    for column in table.columns:
        if column.name.endswith(NOT_CONTENT):
            continue
        both = one[column.name], other[column.name]
        found = _apart(column, *both) if column.kind in ("f32", "f64", "floats") else _unlike(column, *both)
        if found is not None:
            worst.append(found)
    if worst:
        _, said = max(worst)
        more = f"; {len(worst) - 1} more columns" if len(worst) > 1 else ""
        yield error(CHECK, name, f"{table.name}: {said}{more}")


def _apart(column: Column, mine: pa.ChunkedArray, theirs: pa.ChunkedArray) -> tuple[float, str] | None:
    """By how many tolerances numbers are apart, and in words; None: within."""
    one, other = (_numbers(values) for values in (mine, theirs))
    if len(one) != len(other) or (np.isnan(one) != np.isnan(other)).any():
        return np.inf, f"{column.name} is null on other rows"
    off = np.abs(one - other)
    allowed = TOLERANCES.get(column.unit, 0.0) + SHARE * np.fmax(np.abs(one), np.abs(other))
    beyond = np.flatnonzero(off > allowed)
    if not len(beyond):
        return None
    row = beyond[np.argmax(off[beyond] / allowed[beyond])]
    unit = f" {column.unit}" if column.unit else ""
    said = f"{column.name} is {one[row]:.6g}, there {other[row]:.6g}{unit}"
    return float(off[row] / allowed[row]), f"{said}, apart on {len(beyond)} of {len(one)} rows"


def _numbers(values: pa.ChunkedArray) -> np.ndarray:
    if pa.types.is_list(values.type):
        values = pc.list_flatten(values)
    return np.asarray(pc.fill_null(values.cast(pa.float64()), np.nan).to_numpy(), dtype=float)


def _unlike(column: Column, mine: pa.ChunkedArray, theirs: pa.ChunkedArray) -> tuple[float, str] | None:
    one, other = mine.to_pylist(), theirs.to_pylist()
    rows: Sequence[int] = [k for k, (a, b) in enumerate(zip(one, other, strict=True)) if a != b]
    if not rows:
        return None
    said = f"{column.name} is {one[rows[0]]}, there {other[rows[0]]}, on {len(rows)} of {len(one)} rows"
    return 1.0, said
