"""From what workers made to a release: shared tables, texts, manifest, and one rename at the end."""

import hashlib
import json
import os
import platform
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow as pa

from addb_viewer.dataset.build_task import REASONS, LeftOut, MadeFile, Receipt, made_file
from addb_viewer.dataset.grid import LONGEST, SHORTEST
from addb_viewer.dataset.parquet_files import rows_of, sorted_rows, write_parquet
from addb_viewer.dataset.reader import MANIFEST
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import BuildOptions
from addb_viewer.dataset.release_tables import FORMAT_VERSION, LEFT_OUT, ROOT_TABLES, schema_json
from addb_viewer.dataset.release_texts import citations, croissant_of, datasheet, licences, readme
from addb_viewer.dataset.splits import without_persons
from solver.capture.atomic import write_whole
from solver.capture.plates.force_settings import CONDITIONING
from solver.common.operating_system import sync_folder

FIRST_VERSION = "1.0.0"
TEXTS = ("croissant.json", "README.md", "DATASHEET.md", "CITATION.bib")  # that follow from the rest
_PACKAGES = ("addb-viewer", "numpy", "scipy", "pin", "pyarrow")


def manifest_of(
    name: str,
    options: BuildOptions,
    receipts: Mapping[str, Receipt],
    files: Mapping[str, MadeFile],
    trials: Sequence[Mapping[str, Any]],
    *,
    totals: Mapping[str, Any],
    previous: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """All of it; no dates, no places.

    Args:
        name: of the release.
        options: that it was built with.
        receipts: by subject.
        files: by path.
        trials: rows of the table.
        totals: of the release.
        previous: manifest of the release that this one takes the place of.
    """
    settings = {_sha(one.settings): one.settings for one in receipts.values()}
    subjects = {
        subject: {
            "key": one.key,
            "inputs": dict(one.inputs),
            "settings": _sha(one.settings),
            "trials": [row["trial_id"] for row in trials if row["subject_id"] == subject],
            "frames": sum(row["frames_rows"] for row in trials if row["subject_id"] == subject),
        }
        for subject, one in sorted(receipts.items())
    }
    plain: dict[str, Any] = {
        "format_version": FORMAT_VERSION,
        "name": name,
        "created_with": {"python": platform.python_version(), **{p: version(p) for p in _PACKAGES}},
        "machine": platform.machine(),
        "rate_hz": options.rate_hz,
        "filter": {
            "cutoff_hz": CONDITIONING.cutoff_Hz,
            "nyquist_share": CONDITIONING.nyquist_share,
            "order": CONDITIONING.order,
            "passes": 2,
        },
        "segments": {"longest": LONGEST, "shortest": SHORTEST},
        "options": _told(options),
        "withdrawn": list(options.withdrawals),
        "gates": {level: dict(reasons) for level, reasons in REASONS.items()},
        "settings": dict(sorted(settings.items())),
        "subjects": subjects,
        "files": described(files),
        "totals": dict(totals),
        "schema_sha256": _sha(json.dumps(schema_json(), sort_keys=True)),
    }
    plain["version"] = next_version(previous, plain)
    if previous is not None:
        same = plain["version"] == previous["version"]
        told = (
            previous.get("previous") if same else {"name": previous["name"], "version": previous["version"]}
        )
        plain["previous"] = told
    return plain


def _told(options: BuildOptions) -> dict[str, Any]:
    """Options without the names and hashes of who withdrew."""
    plain = asdict(options)
    del plain["withdrawn"]
    return plain | {"without": len(options.without)}


def next_version(previous: Mapping[str, Any] | None, now: Mapping[str, Any]) -> str:
    """A frame of an old subject changed: MAJOR; subjects or columns added: MINOR; other files: PATCH.

    Args:
        previous: manifest of the release before; None: there is none.
        now: of this one, without its version.
    """
    if previous is None:
        return FIRST_VERSION
    major, minor, patch = (int(part) for part in previous["version"].split("."))
    before, after = _frame_files(previous), _frame_files(now)
    if any(after.get(path) != digest for path, digest in before.items()):
        return f"{major + 1}.0.0"
    if set(after) - set(before) or previous["schema_sha256"] != now["schema_sha256"]:
        return f"{major}.{minor + 1}.0"
    return previous["version"] if _hashes(previous) == _hashes(now) else f"{major}.{minor}.{patch + 1}"


def _hashes(manifest: Mapping[str, Any]) -> dict[str, str]:
    """Of all files that do not themselves state the version."""
    return {path: one["sha256"] for path, one in manifest["files"].items() if path not in TEXTS}


def _frame_files(manifest: Mapping[str, Any]) -> dict[str, str]:
    return {path: one["sha256"] for path, one in manifest["files"].items() if path.startswith("frames/")}


def described(files: Mapping[str, MadeFile]) -> dict[str, dict[str, Any]]:
    """Size, hash and rows of each file, in order of their paths."""
    return {path: _file(one) for path, one in sorted(files.items())}


def _file(one: MadeFile) -> dict[str, Any]:
    plain: dict[str, Any] = {"sha256": one.sha256, "bytes": one.bytes}
    return plain if one.rows is None else plain | {"rows": one.rows}


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


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
    sync_folder(partial)
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
    rows[LEFT_OUT.name] = [asdict(one) for one in left_out]
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
