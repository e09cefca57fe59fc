"""Marker files with every trap that was seen in the field, and round trips through OpenSim."""

import re
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.capture.capture import Markers
from solver.capture.formats.trc import read_trc, write_trc
from solver.common.errors import CaptureError
from tests.solver.capture.formats.test_storage import damaged

KEYS = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"
NAMES = ("LASI", "RASI", "SACR")
FRAMES = 5

# Three markers of one pelvis, some 0.3 m apart, moving; in mm.
POSITIONS_MM = np.array(
    [[[10 * f + 100 * m + 1, 1000 + f + 20 * m, 250 * (m - 1) + 3] for m in range(3)] for f in range(FRAMES)],
    float,
)


def trc(
    cells=None,
    *,
    header=None,
    names="Frame#\tTime\tLASI\t\t\tRASI\t\t\tSACR\t\t",
    axes=True,
    blank="\n",
    times=None,
    end="\n",
):
    """The text of a small .trc file; `cells` are its rows' coordinates as they are to be written."""
    cells = [[f"{x:g}" for x in row.ravel()] for row in POSITIONS_MM] if cells is None else cells
    times = [f"{k / 100:.3f}" for k in range(len(cells))] if times is None else times
    header = f"100\t100\t{FRAMES}\t3\tmm\t100\t1\t{FRAMES}" if header is None else header
    keys = "\t".join(KEYS.split())
    axis_row = "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3\n" if axes else ""
    rows = "\n".join(
        "\t".join([str(k + 1), t, *row]) for k, (t, row) in enumerate(zip(times, cells, strict=True))
    )
    return f"PathFileType\t4\t(X/Y/Z)\tx.trc\n{keys}\n{header}\n{names}\n{axis_row}{blank}{rows}{end}"


@pytest.fixture
def read(tmp_path):
    def write_and_read(text):
        path = tmp_path / "walk.trc"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_trc(path)

    return write_and_read


def changed(row, column, cell):
    cells = [[f"{x:g}" for x in values.ravel()] for values in POSITIONS_MM]
    cells[row][column] = cell
    return cells


def assert_whole(file, notes=0):
    assert file.markers.names == NAMES
    np.testing.assert_allclose(file.markers.positions_ground, POSITIONS_MM / 1000, atol=1e-9)
    assert (file.markers.rate, file.markers.start_time) == (100, 0)
    assert len(file.notes) == notes, file.notes


@pytest.mark.parametrize(
    "text",
    [
        trc(),
        trc(end=""),
        trc(end="\n\n\n"),
        trc(blank=""),
        trc(axes=False),
        trc(axes=False, blank=""),
        trc(header="100\t100\t5\t3\tmm\t100"),
        trc(header="  100.0\t\t  100.0\t\t    5\t\t     3\t\t mm\t  100.0\t      1\t    5"),
        trc().replace("\n", "\r\n"),
        trc(end="").replace("\n", "\r\n"),
        trc().replace("\t", "\t ").replace("\t \t", "\t\t"),
        "\n".join(line + "\t\t" for line in trc().splitlines()),
        trc(names="Frame#\tTimes\t\tLASI\t\tRASI\t\tSACR\t"),
        trc(names="Frame#\tTime            LASI                 RASI                 SACR              "),
        re.sub(r"^(?=\d+\t0\.)", "\t", trc(), flags=re.MULTILINE),
        trc(names="Frame# Time LASI RASI SACR").replace("\t", " "),
        trc(names="Frame#\tTime\tLASI\t\t\tRASI\t\t\tSACR")
        .replace("\n\n1\t", "\n\n   1 ")
        .replace("\t", " "),
    ],
    ids=[
        "plain",
        "no newline at the end",
        "blank lines at the end",
        "no blank line after the header",
        "no axis row",
        "neither",
        "six header values",
        "padded header",
        "CRLF",
        "CRLF, no newline at the end",
        "padded cells",
        "trailing tabs",
        "names two tabs apart",
        "names in columns of one width",
        "a tab before each row",
        "spaces",
        "spaces, padded frame",
    ],
)
def test_layouts_that_say_the_same(read, text):
    assert_whole(read(text))


def test_comma_separated_with_points_and_semicolons_with_decimal_commas(read):
    assert_whole(read(trc().replace("\t", ",")))
    times = [f"{k / 100:.3f}".replace(".", ",") for k in range(FRAMES)]
    assert_whole(read(trc(times=times).replace("\t", ";")))


@pytest.mark.parametrize("missing", ["", " ", "NaN", "nan", "NAN", "-1.#IND"])
def test_missing_cells(read, missing):
    cells = changed(2, 3, missing)
    cells[2][4] = cells[2][5] = missing
    file = read(trc(cells))
    assert np.isnan(file.markers.positions_ground[2, 1]).all()
    assert np.isnan(file.markers.positions_ground).sum() == 3
    assert file.notes == ()


def test_gaps_at_the_end_of_rows_whose_tabs_were_trimmed(read):
    cells = [[f"{x:g}" for x in row.ravel()][: 6 if k == 1 else 9] for k, row in enumerate(POSITIONS_MM)]
    file = read(trc(cells))
    assert np.isnan(file.markers.positions_ground[1, 2]).all()
    assert np.isfinite(file.markers.positions_ground).sum() == 3 * (3 * FRAMES - 1)
    assert "line 8" in file.notes[0]


def test_a_short_row_between_spaces_is_an_error_since_nobody_knows_which_marker_is_missing(read):
    cells = changed(2, 3, "")
    cells[2][4] = cells[2][5] = ""
    with pytest.raises(CaptureError, match=r"line 9 holds 8 numbers, but the names need 11"):
        read(trc(cells, names="Frame# Time LASI RASI SACR").replace("\t", " "))


def test_a_torn_marker_counts_as_not_seen(read):
    file = read(trc(changed(2, 4, "")))
    assert np.isnan(file.markers.positions_ground[2, 1]).all()
    assert any("RASI (1 frames)" in note and "coordinate is missing" in note for note in file.notes)


def test_zeros_count_as_not_seen_and_are_listed(read):
    cells = changed(2, 3, "0")
    cells[2][4], cells[2][5] = "0.000", "-0"
    file = read(trc(cells))
    assert np.isnan(file.markers.positions_ground[2, 1]).all()
    assert any("0 0 0 counts as not seen: RASI (1 frames)" in note for note in file.notes)


def test_placeholders_a_kilometre_away_count_as_not_seen(read):
    file = read(trc(changed(2, 3, "9999999.0")))
    assert np.isnan(file.markers.positions_ground[2, 1]).all()
    assert any("RASI (1 frames)" in note for note in file.notes)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("100\t100\t9\t3\tmm\t100\t1\t9", "header says 9 frames, the file holds 5; is the file cut off?"),
        ("100\t100\t3\t3\tmm\t100\t1\t3", "header says 3 frames, the file holds 5"),
        ("100\t100\t5\t7\tmm\t100\t1\t5", "header says 7 markers, the line of names 3"),
        ("200\t200\t5\t3\tmm\t200\t1\t5", "header says 200 Hz, the time column 100 Hz"),
    ],
)
def test_a_header_that_disagrees_with_the_data_is_noted(read, header, message):
    file = read(trc(header=header))
    assert_whole(file, notes=1)
    assert message in file.notes[0]


def test_duplicate_names_are_numbered(read):
    file = read(trc(names="Frame#\tTime\tLASI\t\t\tRASI\t\t\tLASI\t\t"))
    assert file.markers.names == ("LASI", "RASI", "LASI#2")
    assert "more than one marker is called LASI" in file.notes[0]


def test_unnamed_markers_are_ignored_and_listed(read):
    file = read(trc(names="Frame#\tTime\tLASI\t\t\t\t\t\tSACR\t\t"))
    assert file.markers.names == ("LASI", "SACR")
    np.testing.assert_allclose(file.markers.positions_ground, POSITIONS_MM[:, [0, 2]] / 1000)
    assert any("1 markers without a name are ignored, in place 2" in note for note in file.notes)


def test_no_named_marker_is_an_error(read):
    with pytest.raises(CaptureError, match=r"line 4 names no marker; the rows hold 3 markers without a name"):
        read(trc(names="Frame#\tTime\t"))


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("Frame# Time LASI RASI", "holds 2 names, the rows 3 markers: which is which"),
        ("Frame# Time LASI RASI SACR LKNE", "holds 4 names, but rows of 11 numbers have room for 3"),
    ],
)
def test_names_and_columns_that_dont_match_are_an_error(read, names, message):
    with pytest.raises(CaptureError, match=message):
        read(trc(names=names))


@pytest.mark.parametrize(
    ("unit", "per_metre"), [("mm", 1000), ("cm", 100), ("m", 1), ("Meters", 1), ("MM", 1000)]
)
def test_units(read, unit, per_metre):
    cells = [[f"{x:.9g}" for x in row.ravel() / 1000 * per_metre] for row in POSITIONS_MM]
    assert_whole(read(trc(cells, header=f"100\t100\t5\t3\t{unit}\t100\t1\t5")))


def test_units_that_contradict_the_size_of_a_person_are_noted(read):
    file = read(trc(header="100\t100\t5\t3\tm\t100\t1\t5"))
    assert_whole(file, notes=1)
    assert "the header says m, but then the markers would span 540 m; read as mm" in file.notes[0]


def test_units_that_fit_nothing_are_an_error(read):
    cells = [[f"{x:.9g}" for x in row.ravel() * 1e5] for row in POSITIONS_MM]
    with pytest.raises(
        CaptureError, match=r"units 'mm' in the header, but then the markers span 5\.4e\+04 m"
    ):
        read(trc(cells))


def test_a_rate_in_words_is_not_taken_for_a_unit(read):
    assert_whole(read(trc(header="fast\tfast\t5\t3\tmm\t100\t1\t5")), notes=0)


def test_counts_are_found_beside_a_blank_unit(read):
    file = read(trc(header="100\t100\t5\t3\t\t100\t1\t5"))
    assert_whole(file, notes=1)
    assert "no units; mm assumed" in file.notes[0]


def test_missing_units_are_judged_by_the_data_and_unknown_ones_named(read):
    file = read(trc(header="100\t100\t5\t3"))
    assert_whole(file, notes=1)
    assert "no units; mm assumed" in file.notes[0]
    with pytest.raises(CaptureError, match="unknown units 'furlong'"):
        read(trc(header="100\t100\t5\t3\tfurlong\t100\t1\t5"))


def test_missing_rows_become_frames_without_markers(read):
    file = read(trc(times=["0.00", "0.01", "0.02", "0.05", "0.06"], header="100\t100\t5\t3\tmm"))
    assert file.markers.frames == 7
    assert np.isnan(file.markers.positions_ground[3:5]).all()
    np.testing.assert_allclose(file.markers.positions_ground[[0, 1, 2, 5, 6]], POSITIONS_MM / 1000)
    assert "2 rows are missing" in file.notes[0]


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (["0.00", "0.01", "0.02", "0.00", "0.01"], r"line 10: time runs backwards, from 0\.02 to 0 s"),
        (["0.0000", "0.0100", "0.0234", "0.0300", "0.0400"], r"line \d+: the time steps are irregular"),
    ],
)
def test_bad_times_are_errors_that_name_the_line(read, times, message):
    with pytest.raises(CaptureError, match=message):
        read(trc(times=times))


def test_letters_are_an_error_that_names_line_and_column(read):
    with pytest.raises(CaptureError, match=r"walk\.trc: line 9, column 'RASI Y': '1O22' is not a number"):
        read(trc(changed(2, 4, "1O22")))


def test_a_file_cut_off_inside_its_last_row_says_which(read):
    text = trc(end="")
    with pytest.raises(
        CaptureError, match=rf"line {text.count(chr(10)) + 1}: the file is cut off inside this row"
    ):
        read(text[: text.rindex("\t") - 2])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        (trc([]), "no row of data after the header"),
        ("\n".join(trc().splitlines()[:2]) + "\n", "no line of marker names"),
        (b"\x02P\0\0\0", "not a text file"),
        ("\n".join(trc().splitlines()[:4]) + "\n", "no row of data"),
        (trc().replace("X1", "hello"), "line 5: 'hello"),
    ],
)
def test_files_that_end_too_soon(read, text, message):
    with pytest.raises(CaptureError, match=rf"walk\.trc: .*{message}"):
        read(text)


@pytest.mark.parametrize("units", ["mm", "m"])
def test_what_is_written_reads_back(tmp_path, units):
    path = tmp_path / "out.trc"
    markers = a_walk()
    write_trc(path, markers, units)
    back = read_trc(path)
    assert back.notes == ()
    assert back.markers.names == markers.names
    assert back.markers.rate == markers.rate
    assert back.markers.start_time == pytest.approx(markers.start_time)
    np.testing.assert_allclose(back.markers.positions_ground, markers.positions_ground, atol=1e-9)


def test_unknown_units_are_not_written(tmp_path):
    with pytest.raises(CaptureError, match="choose one of mm, cm, m"):
        write_trc(tmp_path / "out.trc", a_walk(), "inch")


@pytest.mark.opensim
def test_opensim_reads_what_is_written(tmp_path):
    opensim = pytest.importorskip("opensim")
    path = tmp_path / "out.trc"
    markers = a_walk()
    write_trc(path, markers)
    table = opensim.TimeSeriesTableVec3(str(path))
    assert tuple(table.getColumnLabels()) == markers.names
    assert table.getTableMetaDataString("Units") == "mm"
    np.testing.assert_allclose(table.getIndependentColumn(), markers.times, atol=1e-9)
    flat = table.flatten()  # a name of its own: the matrix lives in it
    values = flat.getMatrix().to_numpy().reshape(markers.frames, -1, 3) / 1000
    np.testing.assert_allclose(values, markers.positions_ground, atol=1e-9)


@pytest.mark.real
def test_every_real_file_opens_or_says_what_to_do(real_data):
    unusable = {
        "btk_Empty.trc": "empty",
        "btk_Truncated.trc": "cut off",
        "btk_10002-20130626160334-Unnamed.trc": "Label",
    }
    paths = sorted(path for path in real_data.rglob("*.trc") if "wild" not in path.parts)
    assert len(paths) > 20
    for path in paths:
        if path.name in unusable:
            with pytest.raises(CaptureError, match=unusable[path.name]):
                read_trc(path)
            continue
        markers = read_trc(path).markers
        seen = markers.positions_ground[np.isfinite(markers.positions_ground).any(axis=(1, 2))]
        spread = np.median(np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1), axis=0)
        assert 0.3 < np.linalg.norm(spread) < 4
        assert 20 <= markers.rate <= 500


@pytest.mark.real
@pytest.mark.parametrize(
    ("file", "shape", "rate", "start"),
    [
        ("walk_gait2354_subject01/subject01_walk1.trc", (151, 41, 3), 60, 0),
        ("walk_treadmill_stepwidth/example1/markers.trc", (501, 32, 3), 100, 0),
        ("overground_falisse_AdDB/Gait_7_markers.trc", (281, 61, 3), 100, 0.01),
        ("exo_apo_gordon/S1_NE21_no_exo/NE21.trc", (120, 29, 3), 100, 0.03),
        ("format_trc_mot/dataWithEformat.trc", (5, 14, 3), 119.88012, 0.008342),
        ("format_trc_mot/exampleFormat.trc", (5, 3, 3), 100, 0.01),
    ],
)
def test_real_files_hold_what_their_description_says(real_data, file, shape, rate, start):
    markers = read_trc(real_data / file).markers
    assert markers.positions_ground.shape == shape
    assert markers.rate == pytest.approx(rate)
    assert markers.start_time == start


@pytest.mark.real
@pytest.mark.opensim
def test_agrees_with_opensim_on_a_real_file(real_data):
    opensim = pytest.importorskip("opensim")
    path = real_data / "walk_rajagopal2015" / "markers.trc"
    table = opensim.TimeSeriesTableVec3(str(path))
    markers = read_trc(path).markers
    assert tuple(table.getColumnLabels()) == markers.names
    flat = table.flatten()  # a name of its own: the matrix lives in it
    values = flat.getMatrix().to_numpy().reshape(markers.frames, -1, 3) / 1000
    np.testing.assert_allclose(values, markers.positions_ground, atol=1e-9)


def a_walk() -> Markers:
    positions = np.random.default_rng(1).normal(size=(20, 3, 3)) * 0.4 + 1
    positions[3, 1] = np.nan
    positions[:, 2, 0] = 1 / 3
    return Markers(("R.ASIS", "L.ASIS", "V Sacral"), positions, rate=119.88, start_time=1.25)


@settings(deadline=None)  # the machine may be busy
@given(data=st.data())
def test_damaged_files_open_or_fail_with_a_clear_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("damaged") / "walk.trc"
    path.write_bytes(damaged(trc(), data))
    with suppress(CaptureError):
        markers = read_trc(path).markers
        assert markers.positions_ground.shape == (markers.frames, len(markers.names), 3)
        assert markers.rate > 0
