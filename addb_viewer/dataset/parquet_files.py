"""Parquet as a release has it: the same rows always make the same bytes."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.table import Table
from solver.capture.atomic import whole_file

ROWS_AT_MOST = 32_768  # in a row group


class TableFile:
    """A table's file, written piece by piece in a `with`, whole or not at all.

    Pieces, trials as a rule, are not torn if they fit into a row group.
    """

    def __init__(self, table: Table, path: Path) -> None:
        """Nothing is written yet.

        Args:
            table: of the release.
            path: of the file.
        """
        self._table, self._path = table, path
        self._waiting: list[pa.Table] = []
        self.rows = 0  # so far

    def __enter__(self) -> Self:
        """Open the file beside its place.

        Raises:
            CaptureError: it cannot be written.
        """
        self._stack = ExitStack()
        file = self._stack.enter_context(whole_file(self._path))
        schema = self._table.schema()
        self._writer = self._stack.enter_context(pq.ParquetWriter(file, schema, **_options(self._table)))
        return self

    def add(self, piece: pa.Table) -> int:
        """Add rows; the number of the first of them comes back."""
        first = self.rows
        if self._waiting and sum(one.num_rows for one in self._waiting) + piece.num_rows > ROWS_AT_MOST:
            self._write()
        self._waiting.append(piece)
        if piece.num_rows > ROWS_AT_MOST:
            self._write()  # nothing that follows could share its last row group
        self.rows += piece.num_rows
        return first

    def __exit__(self, kind: Any, error: Any, trace: Any) -> bool | None:
        """Put the file into its place, unless there was an error."""
        if kind is None and (self._waiting or not self.rows):
            self._write()
        return self._stack.__exit__(kind, error, trace)

    def _write(self) -> None:
        pieces = self._waiting or [self._table.schema().empty_table()]
        self._writer.write_table(pa.concat_tables(pieces).combine_chunks(), row_group_size=ROWS_AT_MOST)
        self._waiting = []


def write_parquet(table: Table, rows: pa.Table, path: Path) -> int:
    """Write a table's file, whole or not at all; how many rows it has comes back.

    Args:
        table: of the release.
        rows: in order.
        path: of the file.

    Raises:
        CaptureError: the file cannot be written.
    """
    with TableFile(table, path) as file:
        file.add(rows)
    return file.rows


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
