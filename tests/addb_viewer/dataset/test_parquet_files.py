"""Tables of a release: their schemas, and arrays as their rows."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from addb_viewer.dataset.columns import COORDINATE_NAMES, TRANSLATIONS, Column, Table
from addb_viewer.dataset.parquet_files import repeated, rows_of, sorted_rows, table_of
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_tables import FRAMES, SUBJECT_TABLES, TABLES, schema_json
from solver.skeleton.default_body import default_skeleton

TABLE = Table(
    "things",
    "things.parquet",
    "A row a thing",
    (
        Column("name", "text", "its name"),
        Column("size", "f32?", "its size", "m"),
        Column("count", "i16", "how many"),
        Column("phase", "i8?", "which"),
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


NAMES = [table.name for table in TABLES]
UNITS = {
    "_m": "m",
    "_N": "N",
    "_Nm": "N*m",
    "_s": "s",
    "_kg": "kg",
    "_hz": "Hz",
    "_m_s": "m/s",
    "_m_s2": "m/s^2",
}


@pytest.mark.parametrize("table", TABLES, ids=NAMES)
def test_arrow_has_what_json_says(table):
    told, schema = schema_json()["tables"][table.name], table.schema()
    assert [column["name"] for column in told["columns"]] == schema.names
    for column, field in zip(told["columns"], schema, strict=True):
        kept = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        assert {key: column[key] for key in kept} == kept
        assert kept["description"]
        assert field.nullable == column["nullable"]
    assert json.loads(json.dumps(told)) == told


@pytest.mark.parametrize("table", TABLES, ids=NAMES)
def test_keys_and_order_are_columns_and_no_name_comes_twice(table):
    names = table.schema().names
    assert set(table.key) <= set(names)
    assert set(table.order) <= set(names)
    assert len(set(names)) == len(names)
    assert not {name.lower() for name in names} & {"end", "index", "by", "order", "group", "table"}  # SQL's


@pytest.mark.parametrize("table", TABLES, ids=NAMES)
def test_a_unit_that_ends_a_name_is_the_units_own(table):
    for column in table.columns:
        ends = [end for end in UNITS if column.name.endswith(end)]
        if ends:
            assert column.unit == UNITS[max(ends, key=len)], column.name


def test_the_coordinates_are_those_of_the_default_body():
    body = default_skeleton()
    assert body.dofs == COORDINATE_NAMES
    moves = {c.name for c in body.free_coordinates if c.motion == "translation"}
    assert moves == set(TRANSLATIONS)


def test_a_frame_has_the_size_that_the_design_counts_with():
    floats = sum(column.kind == "f32" for column in FRAMES.columns)
    assert 200 <= floats <= 225


def test_rows_of_a_table_can_be_written_and_read_without_a_word_lost(tmp_path):
    schema = SUBJECT_TABLES[2].schema()
    rows = {name: pa.array(np.zeros(2), schema.field(name).type) for name in schema.names[5:]}
    texts = {name: pa.array(["a", "b"], pa.string()) for name in ("subject_id", "trial_id", "marker")}
    frame = {"frame": pa.array([0, 1], pa.int32())}
    table = pa.table({**texts, **frame, **rows, schema.names[4]: pa.array([0.0, None], pa.float32())}, schema)
    pa.parquet.write_table(table, tmp_path / "one.parquet")
    read = pa.parquet.read_schema(tmp_path / "one.parquet")
    assert read.equals(schema, check_metadata=True)
