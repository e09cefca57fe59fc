"""Text as capture software writes it: encodings, line ends, separators, spellings of NaN."""

import codecs
import math
from pathlib import Path

import pytest

from solver.capture.formats.text_table import (
    Dialect,
    Text,
    dialect_of,
    read_text,
    rows_of_numbers,
    unique_names,
)
from solver.common.errors import CaptureError


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_reads_any_encoding_and_line_end(tmp_path, encoding, line_end):
    path = tmp_path / "text.trc"
    path.write_bytes(line_end.join(["Zoë", "1\t2", ""]).encode(encoding))
    text = read_text(path)
    assert (*text.lines, text.ends_with_newline) == ("Zoë", "1\t2", True)


def test_knows_that_the_last_line_has_no_end(tmp_path):
    path = tmp_path / "text.trc"
    path.write_text("a\nb")
    text = read_text(path)
    assert (*text.lines, text.ends_with_newline) == ("a", "b", False)
    assert (text.lines[-1], text.lines[:1], len(text.lines)) == ("b", ("a",), 2)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b" \n\r\n", "empty"),
        (b"\x02\x50\0\0data", "not a text file"),
        (None, "cannot be read"),
    ],
)
def test_says_why_a_file_is_no_text(tmp_path, content, message):
    path = tmp_path / "text.trc"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(CaptureError, match=rf"text\.trc: .*{message}"):
        read_text(path)


def test_a_byte_order_mark_is_no_binary_file(tmp_path):
    path = tmp_path / "text.mot"
    path.write_bytes(codecs.BOM_UTF16_BE + "time\tx".encode("utf-16-be"))
    assert tuple(read_text(path).lines) == ("time\tx",)


@pytest.mark.parametrize(
    ("line", "dialect"),
    [
        ("1\t0.01\t\t2", Dialect("\t")),
        ("1 0.01 2.5", Dialect(None)),
        ("1,0.01,2.5", Dialect(",")),
        ("1, 0.01, 2.5", Dialect(",")),
        ("1;0,01;2,5", Dialect(";", decimal_comma=True)),
        ("1 0,01 2,5", Dialect(None, decimal_comma=True)),
        ("1\t0,01\t2,5", Dialect("\t", decimal_comma=True)),
        ("1\t0.01 2.5 3.5", Dialect(None)),
        ("          0.00\t        15.8\t", Dialect("\t")),
    ],
)
def test_finds_separator_and_decimal_sign(line, dialect):
    assert dialect_of(line) == dialect


def test_a_comma_among_points_is_no_decimal_sign():
    assert not dialect_of("1\t1,234\t2.5").decimal_comma


@pytest.mark.parametrize(
    ("cell", "value"),
    [("1.5", 1.5), ("-1.5e-3", -0.0015), ("+2E+02", 200.0), ("1.5D+02", 150.0), (" 7 ", 7.0)],
)
def test_reads_numbers(cell, value):
    assert parsed(cell) == value


@pytest.mark.parametrize(
    "cell", ["", "  ", "NaN", "nan", "NAN", "-nan", "1.#QNAN", "-1.#IND", "nan(ind)", "N/A"]
)
def test_reads_spellings_of_nan(cell):
    assert math.isnan(parsed(cell))


@pytest.mark.parametrize("cell", ["abc", "1.2.3", "12mm", "O.5"])
def test_names_line_and_column_of_letters(cell):
    with pytest.raises(CaptureError, match=rf"x\.trc: line 3, column 'c1': '{cell}' is not a number"):
        parsed(cell)


def test_repeated_names_get_numbers_that_are_free():
    names, repeated = unique_names(["a", "b", "a", "a#2", "a"])
    assert names == ("a", "b", "a#3", "a#2", "a#4")
    assert repeated == ("a",)


def parsed(cell: str) -> float:
    text = Text(("head", "", f"1\t{cell}"), ends_with_newline=True)
    (row,) = rows_of_numbers(Path("x.trc"), text, 1, Dialect("\t"), lambda k: f"c{k}")
    assert row.line == 3
    return row.values[1]
