"""From arrays to Parquet with the release's own types: the same rows always make the same bytes."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from addb_viewer.dataset.columns import Column, Table
from addb_viewer.dataset.release_errors import ReleaseError
from solver.capture.atomic import whole_file

Values = Any  # an array, a masked array, a list with None for null, or one text for all rows


def table_of(table: Table, columns: Mapping[str, Values], rows: int) -> pa.Table:
    """Arrow's table with every column of the schema, in its order.

    Args:
        table: of the release.
        columns: values by name; one text or number stands for all rows. Nullable ones may be missing.
        rows: how many.

    Raises:
        ReleaseError: a column is unknown, is missing, or has no number where the schema asks for one.
    """
    schema = table.schema()
    strange = set(columns) - set(schema.names)
    if strange:
        raise ReleaseError(f"{table.name} has no column '{sorted(strange)[0]}'")
    arrays = []
    for column, field in zip(table.columns, schema, strict=True):
        array = _array(column, columns.get(column.name), rows, field.type)
        if not column.nullable and array.null_count:
            raise ReleaseError(f"{table.name}: {column.name} has no value in {array.null_count} rows")
        arrays.append(array)
    return pa.Table.from_arrays(arrays, schema=schema)


def rows_of(table: Table, rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Likewise from one mapping a row; None is null."""
    columns = {column.name: [row.get(column.name) for row in rows] for column in table.columns}
    strange = {name for row in rows for name in row} - set(columns)
    if strange:
        raise ReleaseError(f"{table.name} has no column '{sorted(strange)[0]}'")
    return table_of(table, columns, len(rows))


def sorted_rows(table: Table, rows: pa.Table) -> pa.Table:
    """In the table's own order."""
    return rows.sort_by([(name, "ascending") for name in table.order]) if rows.num_rows > 1 else rows


def _array(column: Column, values: Values, rows: int, type_: pa.DataType) -> pa.Array:
    if values is None:
        return pa.nulls(rows, type_)
    if column.kind == "text" and isinstance(values, np.ndarray) and values.dtype.kind in "iu":
        raise ReleaseError(f"{column.name}: numbers where texts belong")
    if isinstance(values, str | bool | int | float | np.generic):
        return pa.repeat(pa.scalar(values, type_), rows)
    if column.kind == "floats" and isinstance(values, np.ndarray):
        flat = np.asarray(values, np.float32)
        offsets = np.arange(rows + 1, dtype=np.int32) * (flat.shape[1] if flat.ndim == 2 else 0)
        return pa.ListArray.from_arrays(offsets, pa.array(flat.reshape(-1)), type=type_)
    if isinstance(values, np.ma.MaskedArray):
        return pa.array(values.filled(0), mask=np.ma.getmaskarray(values), type=type_)
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        return pa.array(values.astype(type_.to_pandas_dtype(), copy=False), type=type_, from_pandas=True)
    return pa.array(values, type=type_, from_pandas=True)


def repeated(names: Sequence[str], times: int) -> pa.Array:
    """Each text so many times, one after the other."""
    places = np.repeat(np.arange(len(names), dtype=np.int32), times)
    return pa.DictionaryArray.from_arrays(places, pa.array(list(names), pa.string())).cast(pa.string())


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
