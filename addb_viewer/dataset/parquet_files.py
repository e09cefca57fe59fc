"""Parquet as a release has it: the same rows always make the same bytes."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.table import Table
from solver.capture.atomic import whole_file

ROWS_AT_MOST = 32_768  # in a row group


def write_parquet(table: Table, pieces: Iterable[pa.Table], path: Path) -> int:
    """Write a table's file, whole or not at all; pieces, trials as a rule, are not torn if they fit.

    Args:
        table: of the release.
        pieces: its rows in order.
        path: of the file.

    Returns:
        How many rows it has.

    Raises:
        CaptureError: the file cannot be written.
    """
    rows, schema = 0, table.schema()
    with whole_file(path) as file, pq.ParquetWriter(file, schema, **_options(table)) as writer:
        for group in _groups(pieces, schema):
            writer.write_table(group, row_group_size=ROWS_AT_MOST)
            rows += group.num_rows
    return rows


def _groups(pieces: Iterable[pa.Table], schema: pa.Schema) -> Iterator[pa.Table]:
    """Pieces put together as long as they fit into one row group."""
    waiting: list[pa.Table] = []
    count = 0
    for piece in pieces:
        if waiting and count + piece.num_rows > ROWS_AT_MOST:
            yield pa.concat_tables(waiting).combine_chunks()
            waiting, count = [], 0
        waiting.append(piece)
        count += piece.num_rows
    yield pa.concat_tables(waiting).combine_chunks() if waiting else schema.empty_table()


def _options(table: Table) -> dict[str, Any]:
    """Text by dictionary, floats by streams of bytes, whole numbers by differences."""
    lists = {"texts": "list.element", "floats": "list.element"}
    texts, encoding = [], {}
    for column in table.columns:
        path = f"{column.name}.{lists[column.kind]}" if column.kind in lists else column.name
        if column.kind in ("text", "texts"):
            texts.append(path)
        elif column.kind in ("f32", "f64", "floats"):
            encoding[path] = "BYTE_STREAM_SPLIT"
        elif column.kind != "bool":
            encoding[path] = "DELTA_BINARY_PACKED"
    return {
        "compression": "zstd",
        "compression_level": 3,
        "use_dictionary": texts,
        "column_encoding": encoding,
        "data_page_version": "2.0",
        "version": "2.6",
        "write_statistics": True,
    }
