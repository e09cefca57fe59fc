"""From arrays with a row a frame to Arrow tables with the release's own types; NaN becomes null."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.table import Column, Table

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
