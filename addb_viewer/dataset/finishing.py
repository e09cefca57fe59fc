"""From what workers made to a release: shared tables, texts, manifest, and one rename at the end."""

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from addb_viewer.dataset.arrow_rows import rows_of, sorted_rows
from addb_viewer.dataset.croissant import croissant_of
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.manifest import described, manifest_of
from addb_viewer.dataset.manifest_file import FILE as MANIFEST
from addb_viewer.dataset.options import BuildOptions
from addb_viewer.dataset.parquet_files import write_parquet
from addb_viewer.dataset.release_texts import citations, datasheet, licences, readme
from addb_viewer.dataset.schema import LEFT_OUT, ROOT_TABLES, schema_json
from addb_viewer.dataset.split_files import without_persons
from addb_viewer.dataset.task import LeftOut, MadeFile, Receipt, made_file
from solver.capture.atomic import write_whole

SPLITS = "splits"
LOG = "build_log.json"  # dates and durations: outside the hashes
SECONDS_PER_HOUR = 3600


def finished(
    out: Path,
    work: Path,
    receipts: Mapping[str, Receipt],
    left_out: Sequence[LeftOut],
    options: BuildOptions,
    *,
    previous: Mapping[str, Any] | None,
    log: Mapping[str, Any],
    published: str | None = None,
) -> dict[str, Any]:
    """Put a release together beside its place and move it there; the one before stays whole until then.

    Args:
        out: folder of the release.
        work: folder with a folder of files for each subject.
        receipts: of the subjects that are in it, by subject_id.
        left_out: everything else.
        options: that it was built with.
        previous: manifest of the release that lies there; None: none does.
        log: dates and durations.
        published: the day, for croissant.json.

    Returns:
        Its manifest.
    """
    partial = out.with_name(out.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    files: dict[str, MadeFile] = {}
    for receipt in receipts.values():
        for path, made in receipt.files.items():
            _link(work / receipt.key / path, partial / path)
            files[path] = made
    rows, tables = _shared_rows(receipts, left_out), {}
    for table in ROOT_TABLES:
        tables[table.name] = sorted_rows(table, rows_of(table, rows[table.name]))
        count = write_parquet(table, tables[table.name], partial / table.path)
        files[table.path] = made_file(partial / table.path, count)
    totals = totals_of(tables)
    if previous is not None:
        _keep_splits(out, partial, options)
    whole = _Made(out.name, options, receipts, files, tables, totals)
    manifest = _texts(partial, whole, previous=previous, published=published)
    write_whole(partial / LOG, _json(log))
    _sync(partial)
    _swap(partial, out)
    return manifest


@dataclass(frozen=True)
class _Made:
    """A release before its texts."""

    name: str
    options: BuildOptions
    receipts: Mapping[str, Receipt]
    files: dict[str, MadeFile]
    tables: Mapping[str, pa.Table]
    totals: Mapping[str, Any]


def totals_of(tables: Mapping[str, pa.Table]) -> dict[str, Any]:
    """How much there is, from the tables."""
    subjects, trials = tables["subjects"].to_pylist(), tables["trials"].to_pylist()
    segments = tables["segments"].to_pylist()
    rate = {row["trial_id"]: (row["frames"] - 1) / max(row["duration_s"], 1e-9) for row in trials}

    def hours(row: Mapping[str, Any], frames: int) -> float:
        return frames / rate[row["trial_id"]] / SECONDS_PER_HOUR

    return {
        "subjects": len(subjects),
        "persons": len({row["person_id"] for row in subjects}),
        "sources": len({row["source"] for row in subjects}),
        "trials": len(trials),
        "segments": len(segments),
        "frames": sum(row["frames_rows"] for row in trials),
        "counting": sum(row["counted"] for row in segments),
        "hours": sum(hours(row, row["end_frame"] - row["start_frame"]) for row in segments),
        "hours_counting": sum(hours(row, row["counted"]) for row in segments),
        "left_out": tables["left_out"].num_rows,
    }


def _shared_rows(
    receipts: Mapping[str, Receipt], left_out: Sequence[LeftOut]
) -> dict[str, list[Mapping[str, Any]]]:
    rows: dict[str, list[Mapping[str, Any]]] = {table.name: [] for table in ROOT_TABLES}
    for _, receipt in sorted(receipts.items()):
        for table, own in receipt.rows.items():
            rows[table] += own
    rows[LEFT_OUT.name] = [one.row() for one in left_out]
    return rows


def _texts(
    folder: Path, made: _Made, *, previous: Mapping[str, Any] | None, published: str | None
) -> dict[str, Any]:
    """Everything that people read, and the manifest with the hashes of all before it."""
    subjects, trials = made.tables["subjects"].to_pylist(), made.tables["trials"].to_pylist()
    left, name, totals = made.tables["left_out"].to_pylist(), made.name, made.totals

    def write(path: str, text: str) -> None:
        write_whole(folder / path, text)
        made.files[path] = made_file(folder / path)

    write("schema.json", _json(schema_json()))
    write("LICENCES.md", licences(subjects))
    manifest = manifest_of(
        name, made.options, made.receipts, made.files, trials, totals=totals, previous=previous
    )
    version = manifest["version"]
    write("README.md", readme(name, version, totals))
    write("CITATION.bib", citations(subjects))
    write("DATASHEET.md", datasheet(name, subjects, trials, left, totals, rate_hz=made.options.rate_hz))
    write("croissant.json", _json(croissant_of(name, version, subjects, made.files, published)))
    manifest["files"] = described(made.files)
    write_whole(folder / MANIFEST, _json(manifest))
    return manifest


def _json(plain: Mapping[str, Any]) -> str:
    return json.dumps(plain, indent=1, ensure_ascii=False, sort_keys=False, allow_nan=False) + "\n"


def _link(source: Path, target: Path) -> None:
    """The same file under two names; a copy where the file system has no such thing."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def _keep_splits(out: Path, partial: Path, options: BuildOptions) -> None:
    """Splits were made from the release before; `split --previous` brings them up to date."""
    if (out / SPLITS).is_dir():
        shutil.copytree(out / SPLITS, partial / SPLITS)
        without_persons(partial, options.leaves_out)


def _sync(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _swap(partial: Path, out: Path) -> None:
    """The new release in the old one's place; a kill between both renames is corrected by `recovered`."""
    old = _old(out)
    shutil.rmtree(old, ignore_errors=True)
    try:
        if out.exists():
            os.rename(out, old)
        os.rename(partial, out)
    except OSError as error:
        raise ReleaseError(f"{out}: cannot be replaced ({error.strerror}).") from error
    shutil.rmtree(old, ignore_errors=True)


def recovered(out: Path) -> None:
    """Put back the release that a killed build had moved aside."""
    if not out.exists() and _old(out).is_dir():
        os.rename(_old(out), out)


def _old(out: Path) -> Path:
    return out.with_name(out.name + ".old")
