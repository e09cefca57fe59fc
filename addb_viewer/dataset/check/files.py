"""Files are those of the manifest, tables those of the schema, and every id leads somewhere."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from addb_viewer.dataset.check.finding import Finding, error, warning
from addb_viewer.dataset.manifest_file import FILE as MANIFEST
from addb_viewer.dataset.schema import ROOT_TABLES, SUBJECT_TABLES
from addb_viewer.dataset.split_files import FOLDER
from addb_viewer.dataset.table import Table

BUILD_LOG = "build_log.json"
_PARENTS = {"subject_id": "subjects", "trial_id": "trials"}  # the table in which an id has its own row


def hash_findings(release: Path, files: Mapping[str, Mapping[str, Any]]) -> Iterator[Finding]:
    """Every file of the manifest is there with its bytes; no other is.

    Args:
        release: its folder.
        files: of the manifest: sha256 by path.
    """
    for path, told in sorted(files.items()):
        place = release / path
        if not place.is_file():
            yield error("files", path, "is missing")
        elif _sha256(place) != told["sha256"]:
            yield error("files", path, "is not the file that the manifest has the hash of")
    for place in sorted(release.rglob("*")):
        path = place.relative_to(release).as_posix()
        known = path in files or path in (MANIFEST, BUILD_LOG) or path.startswith(f"{FOLDER}/")
        if place.is_file() and not known:
            yield warning("files", path, "is not in the manifest")


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def schema_findings(release: Path, files: Mapping[str, Mapping[str, Any]]) -> Iterator[Finding]:
    """Columns, types, nulls, order, keys, rows and ids of every table.

    Args:
        release: its folder.
        files: of the manifest: rows by path.
    """
    ids = {name: _ids(release / f"{name}.parquet", key) for key, name in _PARENTS.items()}
    for table, path in tables_in(release):
        where = path.relative_to(release).as_posix()
        try:
            held = pq.read_table(path)
        except (pa.ArrowInvalid, OSError) as broken:
            yield error("schema", where, f"cannot be read as Parquet ({broken})")
            continue
        wrong = list(_column_findings(table, held, where))
        yield from wrong
        if wrong:
            continue
        yield from _row_findings(table, held, where)
        rows = files.get(where, {}).get("rows")
        if rows is not None and rows != held.num_rows:
            yield error("schema", where, f"has {held.num_rows} rows, the manifest says {rows}")
        for key, name in _PARENTS.items():
            if key in held.column_names and table.name != name:
                orphans = set(pc.unique(held[key]).to_pylist()) - ids[name] - {None}
                if orphans:
                    yield error("schema", where, f"{key} '{min(orphans)}' is not in {name}.parquet")


def tables_in(release: Path) -> Iterator[tuple[Table, Path]]:
    """Every table of a release with its description.

    Args:
        release: its folder.
    """
    for table in ROOT_TABLES:
        if (release / table.path).is_file():
            yield table, release / table.path
    for table in SUBJECT_TABLES:
        for path in sorted((release / table.name).glob("*.parquet")):
            yield table, path


def _ids(path: Path, key: str) -> set[str]:
    try:
        return set(pq.read_table(path, columns=[key])[key].to_pylist())
    except (OSError, pa.ArrowInvalid):
        return set()


def _column_findings(table: Table, held: pa.Table, where: str) -> Iterator[Finding]:
    schema = table.schema()
    lacking = [name for name in schema.names if name not in held.column_names]
    beyond = [name for name in held.column_names if name not in schema.names]
    if lacking or beyond:
        words = [f"lacks {', '.join(lacking[:3])}"] if lacking else []
        words += [f"has {', '.join(beyond[:3])}, which the schema does not know"] if beyond else []
        yield error("schema", where, " and ".join(words))
        return
    if held.column_names != schema.names:
        yield error("schema", where, "has its columns in another order than the schema")
    for field in schema:
        kind = held.schema.field(field.name).type
        plain = kind.value_type if pa.types.is_dictionary(kind) else kind
        if plain != field.type and not (pa.types.is_list(plain) and pa.types.is_list(field.type)):
            yield error("schema", where, f"{field.name} is {plain}, the schema says {field.type}")
        elif not field.nullable and held[field.name].null_count:
            yield error("schema", where, f"{field.name} has nulls, which the schema does not allow")
        elif pa.types.is_floating(plain) and pc.any(pc.is_nan(held[field.name])).as_py():
            yield error("schema", where, f"{field.name} has NaN; what is not known is null")


def _row_findings(table: Table, held: pa.Table, where: str) -> Iterator[Finding]:
    if not held.num_rows:
        return
    grouped = held.group_by(list(table.key)).aggregate([([], "count_all")])
    if grouped.num_rows < held.num_rows:
        yield error("schema", where, f"has rows with the same {', '.join(table.key)}")
    order = pc.sort_indices(held, [(name, "ascending") for name in table.order]).to_numpy()
    if not _is_sorted(held, table, order):
        yield error("schema", where, f"is not sorted by {', '.join(table.order)}")


def _is_sorted(held: pa.Table, table: Table, order: np.ndarray) -> bool:
    """Equal rows may stand in any order."""
    sorted_rows = held.select(list(table.order)).take(pa.array(order))
    return bool(sorted_rows.equals(held.select(list(table.order)).combine_chunks()))
