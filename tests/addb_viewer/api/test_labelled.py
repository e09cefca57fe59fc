"""Named arrays: columns by name, read-only, and as frames of packages that need not be there."""

import sys

import numpy as np
import pytest

from addb_viewer import Series, Table

TIMES = np.array([0.0, 0.01, 0.02])


@pytest.fixture
def angles():
    return Series(np.arange(6.0).reshape(3, 2), ("knee_r", "pelvis_tx"), ("rad", "m"), TIMES)


@pytest.fixture
def places():
    return Series(np.arange(18.0).reshape(3, 2, 3), ("LASI", "RASI"), ("m", "m"), TIMES)


def test_a_column_by_its_name(angles, places):
    assert angles["pelvis_tx"].tolist() == [1.0, 3.0, 5.0]
    assert places["RASI"].tolist() == [[3.0, 4.0, 5.0], [9.0, 10.0, 11.0], [15.0, 16.0, 17.0]]


def test_a_name_that_is_not_there_is_told_with_the_nearest(angles):
    with pytest.raises(KeyError) as told:
        angles["knee_l"]
    assert str(told.value) == "no column 'knee_l'; nearest: knee_r"


def test_nobody_changes_a_result_nor_is_the_callers_array_locked(angles):
    with pytest.raises(ValueError, match="read-only"):
        angles.values[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        angles["knee_r"][0] = 1.0
    own = np.zeros((3, 1))
    Series(own, ("a",), ("m",), TIMES)
    own[0] = 1.0


def test_numpy_takes_a_series(angles):
    assert np.mean(angles) == 2.5
    assert np.asarray(angles, dtype=int).sum() == 15


def test_units_are_of_each_column(angles, places):
    assert places.unit == "m"
    with pytest.raises(ValueError, match="rad, m"):
        angles.unit  # noqa: B018 (asking is the test)


def test_a_table_has_time_axes_and_units_in_its_names(angles, places):
    assert angles.table.names == ("time_s", "knee_r_rad", "pelvis_tx_m")
    assert places.table.names[1:4] == ("LASI_x_m", "LASI_y_m", "LASI_z_m")
    assert places.table["RASI_z_m"].tolist() == [5.0, 11.0, 17.0]
    assert next(iter(angles.table)) == {"time_s": 0.0, "knee_r_rad": 0.0, "pelvis_tx_m": 1.0}


def test_standard_deviations_go_with_their_column(angles):
    known = Series(angles.values, angles.names, angles.units, TIMES, angles.values / 10)
    assert known.std_of("pelvis_tx").tolist() == [0.1, 0.3, 0.5]
    with pytest.raises(ValueError, match="read-only"):
        known.std[0, 0] = 1.0
    assert known.table.names[1:] == ("knee_r_rad", "knee_r_std_rad", "pelvis_tx_m", "pelvis_tx_std_m")
    assert repr(known) == "<Series 3 × 2 [rad, m] ± std, 0.00 to 0.02 s: knee_r, pelvis_tx>"
    assert np.isnan(angles.std_of("knee_r")).tolist() == [True] * 3


def test_what_it_holds_stands_in_a_line(angles):
    assert repr(angles) == "<Series 3 × 2 [rad, m], 0.00 to 0.02 s: knee_r, pelvis_tx>"
    assert repr(angles.table) == "<Table 3 rows × 3 columns: time_s, knee_r_rad, pelvis_tx_m>"


def test_a_printed_table_shows_its_first_rows():
    table = Table({"n": np.arange(22), "x": np.full(22, 1 / 3), "why": np.array(["a"] * 22, dtype=object)})
    lines = str(table).splitlines()
    assert lines[:2] == [" n       x  why", " 0  0.3333    a"]
    assert len(lines) == 22
    assert lines[-1] == "… 2 more rows"
    assert str(Table({})) == ""


TABLE = Table({"n": np.array([1, 2]), "x": np.array([0.5, np.nan]), "why": np.array(["", "b"], dtype=object)})


def test_a_polars_frame_has_null_where_there_is_no_number():
    polars = pytest.importorskip("polars", reason="Polars is not installed")
    frame = TABLE.to_polars()
    assert frame.schema == {"n": polars.Int64, "x": polars.Float64, "why": polars.String}
    assert frame.rows() == [(1, 0.5, ""), (2, None, "b")]


def test_a_pandas_frame_has_nan_there():
    pytest.importorskip("pandas", reason="pandas is not installed")
    frame = TABLE.to_pandas()
    assert list(frame.columns) == ["n", "x", "why"]
    assert frame["x"].isna().tolist() == [False, True]


@pytest.mark.parametrize("package", ["polars", "pandas"])
def test_without_the_package_the_error_says_how_to_get_it(package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)  # an import of it fails
    with pytest.raises(ImportError, match=f"python -m pip install {package}"):
        getattr(TABLE, f"to_{package}")()
