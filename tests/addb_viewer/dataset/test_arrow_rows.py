import numpy as np
import pyarrow as pa
import pytest

from addb_viewer.dataset.columns import Column, Table
from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.parquet_files import repeated, rows_of, sorted_rows, table_of

TABLE = Table(
    "things",
    "things.parquet",
    "A row a thing",
    (
        Column("name", "text", "its name"),
        Column("size", "f32", "its size", "m", nullable=True),
        Column("count", "i16", "how many"),
        Column("phase", "i8", "which", nullable=True),
        Column("notes", "texts", "what is said"),
        Column("values", "floats", "numbers"),
    ),
    key=("name",),
    order=("name",),
)


def test_rows_with_lists_of_any_length_and_nulls():
    rows = [
        {"name": "b", "size": None, "count": 2, "notes": ["x", "y", "z"], "values": [1.0]},
        {"name": "a", "size": 0.1, "count": 1, "phase": 3, "notes": [], "values": []},
    ]
    got = sorted_rows(TABLE, rows_of(TABLE, rows)).to_pylist()
    assert [row["name"] for row in got] == ["a", "b"]
    assert got[0]["size"] == np.float32(0.1)
    assert (got[0]["phase"], got[1]["phase"], got[1]["size"]) == (3, None, None)
    assert got[1]["notes"] == ["x", "y", "z"]


def test_columns_of_arrays_have_nulls_where_there_is_no_number():
    columns = {
        "name": "all the same",
        "size": np.array([1.0, np.nan]),
        "count": np.arange(2),
        "phase": np.ma.MaskedArray([1, 2], mask=[True, False]),
        "notes": [["x"], []],
        "values": np.ones((2, 0)),
    }
    got = table_of(TABLE, columns, 2).to_pylist()
    assert [row["size"] for row in got] == [1.0, None]
    assert [row["phase"] for row in got] == [None, 2]
    assert [row["name"] for row in got] == ["all the same"] * 2
    assert [row["values"] for row in got] == [[], []]
    assert table_of(TABLE, columns | {"values": np.eye(2)}, 2)["values"].to_pylist() == [[1, 0], [0, 1]]


def test_what_the_schema_does_not_have_or_has_to_have():
    row = {"name": "a", "count": 1, "notes": [], "values": []}
    with pytest.raises(ReleaseError, match="things has no column 'colour'"):
        rows_of(TABLE, [row | {"colour": "red"}])
    with pytest.raises(ReleaseError, match="things: count has no value in 1 rows"):
        rows_of(TABLE, [row | {"count": None}])


def test_names_that_are_repeated():
    assert repeated(["a", "b"], 2).equals(pa.array(["a", "a", "b", "b"]))
