"""Rows of the log as edits. One that cannot be read is passed over and told; it never hides the others."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from textwrap import shorten
from typing import Any, TypeVar

from sqlalchemy import Connection, Row, Select, Table, Text, cast, select

from annotations.errors import ReviewError
from annotations.event_codec import decoded
from annotations.events import IMPORTED, Edit, Event, ImportLabels, ImportTable
from annotations.schema import EDITS
from annotations.unreadable import UnreadableRow, is_text
from annotations.work import LONGEST_NAME, WorkEvent

Made = TypeVar("Made")

_WORDS = 200  # letters of the reason, at most: a row may hold anything
_FIRST = datetime(1970, 1, 1, tzinfo=UTC)  # a machine without a clock begins here
_LAST = datetime(2200, 1, 1, tzinfo=UTC)  # later ones have no place in the logs of sessions, in ns


@dataclass(frozen=True)
class Reading:
    """What was found in the log."""

    edits: tuple[Edit, ...]
    unreadable: tuple[UnreadableRow, ...] = ()  # both in order

    @property
    def last(self) -> int:
        """The highest number of a row, whether it can be read or not; 0 where there is none."""
        numbers = [edit.number for edit in self.edits[-1:]] + [row.number for row in self.unreadable[-1:]]
        return max(numbers, default=0)

    def about(self, trial: str) -> "Reading":
        """What is, or may be, about a trial.

        Args:
            trial: its name.
        """
        return Reading(
            tuple(edit for edit in self.edits if edit.trial == trial),
            tuple(row for row in self.unreadable if row.may_be_about(trial)),
        )


def rows_of(subject: str, log: Table = EDITS) -> Select[Any]:
    """All rows of a subject, in order.

    Args:
        subject: as the log calls it.
        log: the edits, or another table of their columns.
    """
    columns = (log.c.number, log.c.trial, log.c.author, log.c.made_at, log.c.kind)
    content = cast(log.c.content, Text).label("content")  # decoded here, row by row
    return select(*columns, content).where(log.c.subject == subject).order_by(log.c.number)


def read(connection: Connection, wanted: Select[Any]) -> Reading:
    """The edits of rows, and the rows that are none.

    Args:
        connection: to the database.
        wanted: made of `rows_of`.
    """
    return Reading(*each_read(connection, wanted, _edit))


def each_read(
    connection: Connection, wanted: Select[Any], made: Callable[[Row[Any]], Made]
) -> tuple[tuple[Made, ...], tuple[UnreadableRow, ...]]:
    """What each row says, and the rows that nobody can read.

    Args:
        connection: to the database.
        wanted: made of `rows_of`.
        made: of a row whose words are text; raises `ReviewError` where it says nothing.
    """
    found: list[Made] = []
    unreadable = []
    for row in connection.execute(wanted):
        try:
            _check_text(row)
            found.append(made(row))
        except ReviewError as error:
            trial, author = (value if is_text(value) else "" for value in (row.trial, row.author))
            unreadable.append(UnreadableRow(row.number, trial, author, shorten(str(error), _WORDS)))
    return tuple(found), tuple(unreadable)


def check_author(event: Event, author: str) -> None:
    """Refuse an edit of nobody, and labels from files under a person's name.

    Raises:
        ReviewError: it is one.
    """
    if not author.strip():
        raise ReviewError("an edit needs an author's name")
    if (author == IMPORTED) is not isinstance(event, ImportLabels | ImportTable):
        raise ReviewError(f"'{IMPORTED}' stands for labels from files; a person needs another name")


def check_words(trial: str, author: str, event: Event | WorkEvent) -> None:
    """Refuse, before it is written, what could not be read back or shown as it is.

    Raises:
        ReviewError: a name that is too long or cannot be printed, or words with a character that is none.
    """
    if len(author) > LONGEST_NAME or not author.isprintable():
        raise ReviewError(
            f"an author's name has at most {LONGEST_NAME} characters, all of which can be read; give another"
        )
    for text in _texts((trial, asdict(event))):
        if "\0" in text or not is_text(text):
            raise ReviewError(
                f"{text[:40]!r} has a character that is none (NUL, or half of a pair); leave it out"
            )


def _texts(content: object) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list | tuple):
        for part in content.values() if isinstance(content, dict) else content:
            yield from _texts(part)


def date_of(text: str) -> datetime:
    """The time of an edit; without a time zone it is UTC.

    Raises:
        ReviewError: it is none, or not one at which an edit can have been made.
    """
    try:
        found = datetime.fromisoformat(text)
        found = found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise ReviewError(f"its date {text[:40]!r} is none") from error
    if not _FIRST <= found < _LAST:
        raise ReviewError(f"its date {text[:40]!r} cannot be that of an edit")
    return found


def _check_text(row: Row[Any]) -> None:
    for name in ("trial", "author", "made_at", "kind", "content"):
        if not is_text(getattr(row, name)):
            raise ReviewError(f"its {name} is not UTF-8 text")


def _edit(row: Row[Any]) -> Edit:
    if row.number < 1:
        raise ReviewError("numbers begin at 1")
    event = decoded(row.kind, _json(row.content))
    check_author(event, row.author)
    return Edit(row.number, row.trial, row.author, date_of(row.made_at), event)


def _json(text: str) -> Mapping[str, Any]:
    try:
        found = json.loads(text)
    except RecursionError as error:
        raise ReviewError("its content is nested too deeply") from error
    except ValueError as error:
        raise ReviewError(f"its content is not JSON ({error})") from error
    if not isinstance(found, dict):
        raise ReviewError("its content is not a JSON object")
    return found
