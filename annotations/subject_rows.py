"""Rows of the log as edits. One that cannot be read is passed over and told; it never hides the others."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from textwrap import shorten
from typing import Any, TypeVar

from sqlalchemy import Connection, Row, Select, Text, cast, func, insert, select

from annotations.database import Database
from annotations.event_codec import KINDS, decoded, encoded
from annotations.events import IMPORTED, LONGEST_NAME, Event, ImportLabels, ImportTable
from annotations.reading import UnreadableRow, is_text
from annotations.review_errors import ReviewError
from annotations.schema import EDITS

Made = TypeVar("Made")

_WORDS = 200  # letters of the reason, at most: a row may hold anything
_FIRST = datetime(1970, 1, 1, tzinfo=UTC)  # a machine without a clock begins here
_LAST = datetime(2200, 1, 1, tzinfo=UTC)  # later ones have no place in the logs of sessions, in ns


class SubjectRows:
    """The rows of one subject in a table of the log: appended and read, never changed or removed."""

    table = EDITS
    kinds: Mapping[str, type[Any]] = KINDS  # what its rows may say

    def __init__(self, database: Database, subject: str) -> None:
        """Take part of a database that others use as well."""
        self._database, self._subject = database, subject

    def revision(self) -> int:
        """The number of the subject's last row, whichever program made it; 0 where there is none."""
        last = select(func.max(self.table.c.number)).where(self.table.c.subject == self._subject)
        with self._database.reading() as connection:
            return connection.scalar(last) or 0

    def _check_empty(self, connection: Connection, what: str) -> None:
        any_row = select(self.table.c.number).where(self.table.c.subject == self._subject).limit(1)
        if connection.scalar(any_row) is not None:
            raise ReviewError(f"{self._database.name}: has {what} of '{self._subject}' already; not copied")

    def _insert(
        self, connection: Connection, trial: str, author: str, event: object, made_at: datetime | None = None
    ) -> int:
        kind, content = encoded(event, self.kinds)
        row = insert(self.table).values(
            subject=self._subject,
            trial=trial,
            author=author,
            made_at=(made_at or datetime.now(UTC)).isoformat(),
            kind=kind,
            content=content,
        )
        number = connection.execute(row).inserted_primary_key
        assert number is not None
        return int(number[0])

    def _wanted(self) -> Select[Any]:
        """All rows of the subject, in order."""
        log = self.table
        columns = (log.c.number, log.c.trial, log.c.author, log.c.made_at, log.c.kind)
        content = cast(log.c.content, Text).label("content")  # decoded here, row by row
        return select(*columns, content).where(log.c.subject == self._subject).order_by(log.c.number)

    def _each(
        self,
        connection: Connection,
        wanted: Select[Any],
        made: Callable[..., Made],
    ) -> tuple[tuple[Made, ...], tuple[UnreadableRow, ...]]:
        """What each row says, and the rows that nobody can read.

        Args:
            connection: to the database.
            wanted: made of `_wanted`.
            made: of number, trial, author, date and event; raises `ReviewError` where it says nothing.
        """
        found: list[Made] = []
        unreadable = []
        for row in connection.execute(wanted):
            try:
                _check_text(row)
                event = decoded(row.kind, _json(row.content), self.kinds)
                found.append(made(row.number, row.trial, row.author, _date(row.made_at), event))
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


def check_words(trial: str, author: str, event: Any) -> None:
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


def _date(text: str) -> datetime:
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
