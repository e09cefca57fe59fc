"""Number tables in text files as laboratories export them: encodings, separators, blanks, ways to say NaN."""

import math
import re
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import overload

from solver.common.errors import CaptureError
from solver.common.file_names import decoded
from solver.common.notes import Kind, Note, noted

MISSING = frozenset(
    {"nan", "+nan", "-nan", "nan(ind)", "-nan(ind)", "nan(snan)", "1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind"}
    | {"na", "n/a", "#n/a", "none", "null", "missing", "-", "--", "*"}
)
FIRST_ROWS = 100  # of a table, among which the fullest tells how numbers are written
FORTRAN_EXPONENT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)[dD][+-]?\d+")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
PLAIN_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")


class Lines(Sequence[str]):
    """The lines of a text, each made when it is asked for: 100 000 at once would leave memory in pieces."""

    def __init__(self, text: str) -> None:
        """Without line ends.

        Args:
            text: whose line ends are all line feeds.
        """
        self._text = text
        self._starts = array("q", [0, *(end.end() for end in re.finditer("\n", text)), len(text) + 1])
        self._count = len(self._starts) - 1 - (not text or text[-1] == "\n")

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[str, ...]: ...

    def __getitem__(self, index: int | slice) -> str | tuple[str, ...]:
        if isinstance(index, slice):
            return tuple(self[k] for k in range(self._count)[index])
        k = range(self._count)[index]
        return self._text[self._starts[k] : self._starts[k + 1] - 1]


@dataclass(frozen=True)
class Text:
    """The lines of a text file, without line ends."""

    lines: Sequence[str]
    ends_with_newline: bool


@dataclass(frozen=True)
class Row:
    """One line of numbers; NaN where a cell is blank or says so. `line` counts from 1."""

    line: int
    values: Sequence[float]  # a part of all rows' numbers, in double precision


@dataclass(frozen=True)
class Dialect:
    """How the cells of a table are written: `separator` None means any run of blanks."""

    separator: str | None
    decimal_comma: bool = False

    def cells(self, line: str) -> list[str]:
        """The cells of a line, stripped."""
        return [cell.strip() for cell in line.split(self.separator)]


def read_text(path: Path, most_bytes: int = -1) -> Text:
    """Read a text file in any encoding and with any line ends that capture software writes.

    Args:
        path: the file.
        most_bytes: stop after so many; all of them by default.

    Raises:
        CaptureError: the file is missing, unreadable, empty, or not text.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(most_bytes)
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read ({error.strerror}).") from error
    if not data.strip():
        raise CaptureError(f"{path}: the file is empty. Export it again.")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16", errors="replace")
    elif b"\0" in data:
        raise CaptureError(f"{path}: not a text file (a C3D file with another ending?). Export it as text.")
    else:
        text = decoded(data)
    del data  # of a long recording as large as its numbers
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return Text(Lines(text), text.endswith("\n"))


def dialect_of(line: str) -> Dialect:
    """Separator and decimal sign, judged by one line of numbers."""
    for separator in ("\t", ";", ","):
        cells = [cell.strip() for cell in line.split(separator)]
        if len(cells) > 1 and not any(re.search(r"\S\s+\S", cell) for cell in cells):
            break
    else:
        separator, cells = None, line.split()
    commas = separator != "," and any(DECIMAL_COMMA.fullmatch(cell) for cell in cells)
    return Dialect(separator, decimal_comma=commas and not any("." in cell for cell in cells))


def dialect_of_rows(text: Text, first: int, end: int | None = None) -> Dialect:
    """Separator and decimal sign of a table, judged by the fullest of its first rows.

    Args:
        text: the file.
        first: index of the first row.
        end: index behind the last row.
    """
    stop = min(len(text.lines) if end is None else end, first + FIRST_ROWS)
    return dialect_of(
        max((text.lines[k] for k in range(first, stop)), key=lambda x: len(re.sub(r"\W", "", x)))
    )


def starts_with_number(line: str) -> bool:
    """Whether the first cell that isn't blank is a number: the mark of a row of data."""
    cells = re.split(r"[\s;,]+", line.strip(), maxsplit=1)
    return bool(PLAIN_NUMBER.fullmatch(cells[0]))


def rows_of_numbers(
    path: Path,
    text: Text,
    first: int,
    dialect: Dialect,
    column_name: Callable[[int], str],
    *,
    end: int | None = None,
) -> list[Row]:
    """Parse every line from index `first` on that isn't blank.

    Args:
        path: for messages.
        text: the file.
        first: index of the first line of data, from 0.
        dialect: how cells are written.
        column_name: what to call a column in a message, by its index from 0.
        end: index behind the last line of data; all that follow by default.

    Raises:
        CaptureError: a cell is neither a number nor a blank nor a spelling of NaN.
    """
    numbers, lines, ends = array("d"), array("q"), array("q", [0])
    for index in range(first, len(text.lines) if end is None else end):
        line = text.lines[index]
        if not line.strip():
            continue
        if dialect.decimal_comma:
            line = line.replace(",", ".")
        cells = line.split(dialect.separator)
        try:
            numbers.extend(map(float, cells))
        except ValueError:
            del numbers[ends[-1] :]
            numbers.extend(
                _number(path, index + 1, column_name, k, cell.strip()) for k, cell in enumerate(cells)
            )
        lines.append(index + 1)
        ends.append(len(numbers))
    whole = memoryview(numbers)
    return [Row(line, whole[a:b]) for line, (a, b) in zip(lines, pairwise(ends), strict=True)]


def unique_names(names: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names with repeats renamed `name#2`, `name#3`, …; and which were repeated, in order."""
    taken = set(names)
    seen: dict[str, int] = {}
    result = []
    for name in names:
        seen[name] = number = seen.get(name, 0) + 1
        fresh = name
        while number > 1 and fresh in taken:
            fresh, number = f"{name}#{number}", number + 1
        taken.add(fresh)
        result.append(fresh)
    return tuple(result), tuple(name for name, count in seen.items() if count > 1)


def number_repeats(
    names: Sequence[str], source: str, what: str = "marker"
) -> tuple[tuple[str, ...], tuple[Note, ...]]:
    """`unique_names`, and a note on those that were repeated.

    Args:
        names: of markers or columns.
        source: the file, for the note.
        what: they are names of.
    """
    unique, repeated = unique_names(names)
    later = "the later ones are called name#2, name#3, …"
    said = f"{source}: more than one {what} is called {', '.join(repeated)}; {later}"
    return unique, noted(Kind.OTHER, said) if repeated else ()


def some_of(names: Sequence[str], most: int = 6) -> str:
    """Names in a sentence: all of a few, of many the first and how many more."""
    more = len(names) - most
    return f"{', '.join(names[:most])} and {more} more" if more > 1 else ", ".join(names)


def _number(path: Path, line: int, column_name: Callable[[int], str], column: int, cell: str) -> float:
    if not cell or cell.lower() in MISSING:
        return math.nan
    try:
        return float(cell)
    except ValueError:
        pass
    if FORTRAN_EXPONENT.fullmatch(cell):
        return float(re.sub("[dD]", "e", cell))
    raise CaptureError(
        f"{path}: line {line}, column '{column_name(column)}': '{cell[:40]}' is not a number. "
        "Correct the cell, or leave it blank where nothing was measured."
    )
