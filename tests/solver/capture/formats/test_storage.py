"""Tables over time with every header that was seen in the field, and round trips through OpenSim."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.capture.formats.storage import (
    coordinates_from_storage,
    read_storage,
    write_coordinates,
    write_storage,
)
from solver.capture.plates.moment_convention import plates_from_storage
from solver.common.errors import CaptureError

LABELS = ("ground_force_vx", "ground_force_vy", "ground_force_vz")
VALUES = np.array([[1.5, 700.25, -3], [2.5, 710.5, -4], [3.5, 720.75, -5], [4.5, 731, -6]])
TIMES = np.array([0.0, 0.01, 0.02, 0.03])
OPENSIM_1 = "title\nversion=1\nnRows=4\nnColumns=4\ninDegrees=yes\nendheader\n"
NAMES = ("pelvis_tilt", "pelvis_rotation", "pelvis_tx", "knee_angle_r", "knee_angle_r_beta")
ROTATIONAL = {"pelvis_tilt", "pelvis_rotation", "knee_angle_r"}
COORDINATE_TIMES = np.arange(101) / 100


def mot(head=OPENSIM_1, labels=("time", *LABELS), rows=None, end="\n"):
    rows = [[f"{x:g}" for x in row] for row in np.column_stack([TIMES, VALUES])] if rows is None else rows
    return head + "\t".join(labels) + "\n" + "\n".join("\t".join(row) for row in rows) + end


def changed(row, column, cell):
    rows = [[f"{x:g}" for x in values] for values in np.column_stack([TIMES, VALUES])]
    rows[row][column] = cell
    return rows


@pytest.fixture
def read(tmp_path):
    def write_and_read(text):
        path = tmp_path / "grf.mot"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_storage(path)

    return write_and_read


def assert_whole(storage, notes=0):
    assert storage.labels == LABELS
    np.testing.assert_allclose(storage.values, VALUES)
    np.testing.assert_allclose(storage.times, TIMES)
    assert storage.rate == 100
    assert len(storage.notes) == notes, storage.notes


@pytest.mark.parametrize(
    ("text", "in_degrees", "name"),
    [
        (mot(), True, "title"),
        (mot(OPENSIM_1.replace("yes", "no")), False, "title"),
        (mot("\n".join(f"{line}\t\t\t" for line in OPENSIM_1.splitlines()) + "\n"), True, "title"),
        (
            mot("name C:\\data\\x y.mot\ndatacolumns 4\ndatarows 4\nrange 0 0.03\nendheader \n"),
            None,
            "C:\\data\\x y.mot",
        ),
        (mot("nColumns=4\nnRows=4\nDataType=double\nversion=3\nOpenSimVersion=4.1\nendheader\n"), None, ""),
        (mot("DataType=double\nversion=3\nendheader\n"), None, ""),
        (
            mot("Coordinates\nversion=1\nnRows=4\ninDegrees=no\n\nSome words: time, angles.\n\nendheader\n"),
            False,
            "Coordinates",
        ),
        (mot(OPENSIM_1 + "\n"), True, "title"),
        (mot(labels=("            time", *(f"   {label}" for label in LABELS), "")), True, "title"),
        (
            mot(rows=[[*(f"{x:15.8f}" for x in row), ""] for row in np.column_stack([TIMES, VALUES])]),
            True,
            "title",
        ),
        (mot().replace("\n", "\r\n"), True, "title"),
        (mot(end=""), True, "title"),
        (mot(end="\n\n"), True, "title"),
        (mot().replace("\t", " "), True, "title"),
        (mot().replace("\t", ","), True, "title"),
        (mot(OPENSIM_1.replace("endheader", "ENDHEADER")), True, "title"),
    ],
)
def test_headers_that_say_the_same(read, text, in_degrees, name):
    storage = read(text)
    assert_whole(storage)
    assert storage.in_degrees is in_degrees
    assert storage.name == name


@pytest.mark.parametrize("head", ["", "title\nsome remark\n", "nRows=4\n"])
def test_no_endheader(read, head):
    storage = read(mot(head))
    assert_whole(storage, notes=1)
    assert "no 'endheader'" in storage.notes[0]


@pytest.mark.parametrize(
    ("head", "note"),
    [
        ("nRows=400\nendheader\n", "header says 400 rows, the file holds 4; is the file cut off?"),
        ("datarows 2\nendheader\n", "header says 2 rows, the file holds 4"),
        ("nColumns=19\nendheader\n", "header says 19 columns, the file holds 4"),
    ],
)
def test_counts_that_disagree_are_noted(read, head, note):
    storage = read(mot(head))
    assert_whole(storage, notes=1)
    assert note in storage.notes[0]


def test_time_need_not_come_first(read):
    order = [1, 0, 2, 3]
    rows = [[row[k] for k in order] for row in changed(0, 0, "0")]
    assert_whole(read(mot(labels=[("time", *LABELS)[k] for k in order], rows=rows)))


def test_duplicate_columns_are_numbered(read):
    storage = read(mot(labels=("time", "a", "b", "a")))
    assert storage.labels == ("a", "b", "a#2")
    assert "more than one column is called a" in storage.notes[0]
    np.testing.assert_array_equal(storage.column("a#2"), VALUES[:, 2])


def test_a_column_without_a_name_is_kept(read):
    storage = read(mot(labels=("time", "a", "", "c")))
    assert storage.labels == ("a", "column_3", "c")
    assert "1 columns without a name" in storage.notes[0]


def test_an_unknown_column_names_the_ones_there_are(read):
    with pytest.raises(CaptureError, match="column 'vx' missing; there are ground_force_vx, ground_force_vy"):
        read(mot()).column("vx")


def test_blanks_and_nan_are_counted(read):
    storage = read(mot(rows=changed(1, 2, "NaN")))
    assert np.isnan(storage.values).sum() == 1
    assert "1 values are blank or NaN" in storage.notes[0]


def test_letters_are_an_error_that_names_line_and_column(read):
    with pytest.raises(
        CaptureError, match=r"grf\.mot: line 9, column 'ground_force_vy': '7l0\.5' is not a number"
    ):
        read(mot(rows=changed(1, 2, "7l0.5")))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        (OPENSIM_1, "nothing follows the header"),
        (OPENSIM_1 + "time\ta\tb\n", "no row of data"),
        ("\n".join(OPENSIM_1.splitlines()[:3]), "neither 'endheader' nor a line of column names"),
        (OPENSIM_1 + "0 1 2\n0.01 3 4\n", "line 7: numbers where the column names belong"),
        (mot(labels=("step", *LABELS)), "no column 'time' among step, ground_force_vx"),
        (
            mot(rows=[["0", "1", "2", "3"], ["0.01", "1", "2"], ["0.02", "1", "2", "3"]]),
            "line 9 holds 3 numbers",
        ),
        (mot(labels=("time", *LABELS, "extra")), "line 8 holds 4 numbers, but there are 5 columns"),
        (mot("DataType=Vec3\nendheader\n"), "only tables of plain numbers"),
        (mot(rows=changed(2, 0, "0.005")), "line 10: time runs backwards"),
    ],
)
def test_files_that_cannot_be_used_say_why(read, text, message):
    with pytest.raises(CaptureError, match=rf"grf\.mot: .*{message}"):
        read(text)


def test_a_file_cut_off_inside_its_last_row_says_which(read):
    text = mot(end="")
    with pytest.raises(
        CaptureError, match=rf"line {text.count(chr(10)) + 1}: the file is cut off inside this row"
    ):
        read(text[: text.rindex("\t") - 1])


def test_uneven_steps_are_kept_and_noted(read):
    rows = [[f"{t:g}", "1", "2", "3"] for t in (0, 0.001, 0.0025, 0.009, 0.0101)]
    storage = read(mot(rows=rows))
    np.testing.assert_allclose(storage.times, [0, 0.001, 0.0025, 0.009, 0.0101])
    assert storage.rate == pytest.approx(4 / 0.0101)
    assert any("irregular" in note for note in storage.notes)


def test_what_is_written_reads_back(tmp_path):
    path = tmp_path / "x.sto"
    values = np.random.default_rng(0).normal(size=(50, 3)) * 1e3
    values[4, 1] = np.nan
    times = 0.3 + np.arange(50) / 120
    write_storage(path, LABELS, times, values, in_degrees=True, name="Forces")
    storage = read_storage(path)
    assert (storage.labels, storage.in_degrees, storage.name) == (LABELS, True, "Forces")
    np.testing.assert_allclose(storage.values, values, rtol=1e-11)
    np.testing.assert_allclose(storage.times, times, rtol=1e-11)


def test_shapes_that_dont_fit_are_not_written(tmp_path):
    with pytest.raises(ValueError, match=r"\(4, 2\) for 4 times and 3 labels"):
        write_storage(tmp_path / "x.sto", LABELS, TIMES, VALUES[:, :2])
    assert not list(tmp_path.iterdir())


@pytest.mark.opensim
@pytest.mark.parametrize("ending", ["mot", "sto"])
def test_opensim_reads_what_is_written(tmp_path, ending):
    opensim = pytest.importorskip("opensim")
    path = tmp_path / f"x.{ending}"
    write_storage(path, LABELS, TIMES, VALUES, in_degrees=True, name="Forces")
    table = opensim.TimeSeriesTable(str(path))
    assert tuple(table.getColumnLabels()) == LABELS
    assert table.getTableMetaDataString("inDegrees") == "yes"
    np.testing.assert_allclose(table.getIndependentColumn(), TIMES)
    np.testing.assert_allclose(table.getMatrix().to_numpy(), VALUES)


@pytest.mark.real
@pytest.mark.opensim
def test_agrees_with_opensim_on_a_real_file(real_data):
    opensim = pytest.importorskip("opensim")
    path = real_data / "walk_gait2354_subject01" / "subject01_walk1_grf.mot"
    table = opensim.TimeSeriesTable(str(path))
    storage = read_storage(path)
    assert tuple(table.getColumnLabels()) == storage.labels
    np.testing.assert_allclose(table.getMatrix().to_numpy(), storage.values)


@pytest.mark.real
def test_every_real_file_opens(real_data):
    paths = [*real_data.rglob("*.mot"), *real_data.rglob("*.sto")]
    assert len(paths) > 30
    for path in paths:
        storage = read_storage(path)
        assert np.isfinite(storage.values).all()
        assert 20 <= storage.rate <= 2000
        assert storage.values.shape[1] == len(set(storage.labels))


@pytest.mark.real
@pytest.mark.parametrize(
    ("file", "shape", "rate", "in_degrees"),
    [
        ("walk_rajagopal2015/grf.mot", (4778, 18), 2000, False),
        ("walk_gait2354_subject01/subject01_walk1_grf.mot", (1501, 18), 600, True),
        ("exo_apo_gordon/S1_NE21_no_exo/NE21.mot", (715, 18), 600, None),
        ("format_trc_mot/subject02_grf_HiFreq.mot", (439, 18), 600, True),
        ("format_trc_mot/JA1Gait35_grf_8plates_73columns.mot", (322, 72), 250, None),
        ("anomalies/WeirdGRF/weird.mot", (1001, 18), 50, True),
        ("synthetic_arnold2013_subject01/grf.mot", (223, 18), 200, None),
    ],
)
def test_real_files_hold_what_their_description_says(real_data, file, shape, rate, in_degrees):
    storage = read_storage(real_data / file)
    assert storage.values.shape == shape
    assert storage.rate == rate
    assert storage.in_degrees is in_degrees


def damaged(text, data):
    """A file cut off somewhere, with some bytes changed."""
    text = bytearray(text.encode())
    text = text[: data.draw(st.integers(0, len(text)), label="cut at")]
    for _ in range(data.draw(st.integers(0, 3), label="damaged bytes") if text else 0):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.integers(0, 255))
    return bytes(text)


@settings(deadline=None)  # the machine may be busy
@given(data=st.data())
def test_damaged_files_open_or_fail_with_a_clear_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("damaged") / "grf.mot"
    path.write_bytes(damaged(mot(), data))
    with suppress(CaptureError):
        storage = read_storage(path)
        assert storage.values.shape == (len(storage.times), len(storage.labels))
        plates_from_storage(storage)


def gait():
    """Walking a loop: the heading turns by more than a whole turn, in radians."""
    knee = 0.5 + 0.5 * np.sin(8 * COORDINATE_TIMES)
    return np.column_stack(
        [0.1 * np.cos(9 * COORDINATE_TIMES), 8 * COORDINATE_TIMES, 1.2 * COORDINATE_TIMES, knee, knee]
    )


@pytest.mark.parametrize("in_degrees", [True, False])
def test_what_is_written_reads_back_in_radians(tmp_path, in_degrees):
    path = tmp_path / "ik.mot"
    write_coordinates(path, NAMES, COORDINATE_TIMES, gait(), rotational=ROTATIONAL, in_degrees=in_degrees)
    storage = read_storage(path)
    assert storage.in_degrees is in_degrees
    if in_degrees:
        np.testing.assert_allclose(storage.column("knee_angle_r"), gait()[:, 3] * 57.29577951308232)
        np.testing.assert_allclose(storage.column("knee_angle_r_beta"), gait()[:, 4])
    coordinates = coordinates_from_storage(storage, ROTATIONAL)
    assert coordinates.names == NAMES
    assert coordinates.notes == ()
    np.testing.assert_allclose(coordinates.values, gait(), atol=1e-9)


@pytest.mark.parametrize(("scale", "unit"), [(180 / np.pi, "degrees"), (1, "radians")])
def test_without_the_header_key_the_data_decide_and_the_notes_say_so(tmp_path, scale, unit):
    path = tmp_path / "ik.mot"
    values = gait() * [scale, scale, 1, scale, 1]
    write_storage(path, NAMES, COORDINATE_TIMES, values)
    path.write_text("\n".join(line for line in path.read_text().splitlines() if "inDegrees" not in line))
    coordinates = coordinates_from_storage(read_storage(path), ROTATIONAL)
    np.testing.assert_allclose(coordinates.values, gait(), atol=1e-9)
    assert f"{unit} assumed" in coordinates.notes[-1]


@pytest.mark.real
def test_beta_is_in_radians_in_opensims_files_in_degrees(real_data):
    storage = read_storage(real_data / "opencap_subject6" / "reference" / "walking1_expert_ik.mot")
    knees = coordinates_from_storage(storage, {"knee_angle_r"})
    columns = [knees.names.index(name) for name in ("knee_angle_r", "knee_angle_r_beta")]
    np.testing.assert_allclose(knees.values[:, columns[0]], knees.values[:, columns[1]], atol=1e-6)


@pytest.mark.real
def test_a_real_file_without_the_key_is_in_radians(real_data):
    storage = read_storage(real_data / "synthetic_arnold2013_subject01" / "coordinates.sto")
    angles = {name for name in storage.labels if not name.endswith(("_tx", "_ty", "_tz"))}
    coordinates = coordinates_from_storage(storage, angles)
    np.testing.assert_array_equal(coordinates.values, storage.values)
    assert "radians assumed" in coordinates.notes[-1]
