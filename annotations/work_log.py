"""The log of who is to review what, and of comments: rows are appended and read, never changed or removed."""

import json
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Connection, Row, func, insert, select

from annotations.database import Database
from annotations.errors import ReviewError
from annotations.events import IMPORTED
from annotations.reading import check_words, date_of, each_read, rows_of
from annotations.schema import WORK
from annotations.unreadable import UnreadableRow, is_text
from annotations.work import Assign, Comment, Settle, WorkEvent, WorkItem, work_of

_WORDS = 200  # letters of why a row cannot be read, at most

KINDS: dict[str, type[WorkEvent]] = {"assign": Assign, "comment": Comment, "settle": Settle}
_KIND_OF = {event: kind for kind, event in KINDS.items()}
_TYPES: dict[str, tuple[type, ...]] = {
    "person": (str,),
    "text": (str,),
    "frame": (int, type(None)),
    "answers": (int, type(None)),
    "comment": (int,),
    "settled": (bool,),
}  # by name of the field


class WorkLog:
    """Assignments and comments of one subject, in the database of its review.

    A row that cannot be read is passed over and stays as it is.
    """

    def __init__(self, database: Database, subject: str) -> None:
        """Take part of a database that others use as well."""
        self._database, self._subject = database, subject

    def append(self, trials: Sequence[str], event: WorkEvent, author: str) -> tuple[int, ...]:
        """Record it for these trials, for all or none; it is on the disk when this returns.

        Args:
            trials: their names.
            event: what is said.
            author: who says it.

        Returns:
            The rows' numbers.

        Raises:
            ReviewError: nobody says it, it has words that cannot be kept, it is about a comment that is not
                there, or the database fails.
        """
        if not author.strip() or author == IMPORTED:
            raise ReviewError("a person's name is needed; say yours")
        for trial in trials:
            check_words(trial, author, event)
        first = event.answers if isinstance(event, Comment) else getattr(event, "comment", None)
        with self._database.writing() as connection:
            for trial in trials if first is not None else ():
                said = [item for item in self._read(connection)[0] if item.trial == trial]
                if first not in [thread.number for thread in work_of(said).comments]:
                    raise ReviewError(f"{trial}: has no comment {first} that could be answered or settled")
            return tuple(self._insert(connection, trial, author, event) for trial in trials)

    def take_over(self, items: Sequence[WorkItem]) -> None:
        """Copy the items of another log, with their authors and dates; they get new numbers.

        Args:
            items: all of the other log's that can be read.

        Raises:
            ReviewError: there are items of this subject already, which would then stand twice.
        """
        number: dict[int, int] = {}
        with self._database.writing() as connection:
            any_row = select(WORK.c.number).where(WORK.c.subject == self._subject).limit(1)
            if items and connection.scalar(any_row) is not None:
                raise ReviewError(
                    f"{self._database.name}: has comments of '{self._subject}' already; not copied"
                )
            for item in items:
                event = item.event
                if isinstance(event, Settle):
                    event = replace(event, comment=number.get(event.comment, event.comment))
                elif isinstance(event, Comment) and event.answers is not None:
                    event = replace(event, answers=number.get(event.answers, event.answers))
                new = self._insert(connection, item.trial, item.author, event, item.made_at)
                number[item.number] = new

    def reading(self) -> tuple[tuple[WorkItem, ...], tuple[UnreadableRow, ...]]:
        """All items of the subject, and the rows that cannot be read, both in order."""
        with self._database.reading() as connection:
            return self._read(connection)

    def revision(self) -> int:
        """The number of the subject's last row, whichever program made it; 0 where there is none."""
        last = select(func.max(WORK.c.number)).where(WORK.c.subject == self._subject)
        with self._database.reading() as connection:
            return connection.scalar(last) or 0

    def _insert(
        self,
        connection: Connection,
        trial: str,
        author: str,
        event: WorkEvent,
        made_at: datetime | None = None,
    ) -> int:
        row = insert(WORK).values(
            subject=self._subject,
            trial=trial,
            author=author,
            made_at=(made_at or datetime.now(UTC)).isoformat(),
            kind=_KIND_OF[type(event)],
            content=asdict(event),
        )
        number = connection.execute(row).inserted_primary_key
        assert number is not None
        return int(number[0])

    def _read(self, connection: Connection) -> tuple[tuple[WorkItem, ...], tuple[UnreadableRow, ...]]:
        return each_read(connection, rows_of(self._subject, WORK), _item)


def _item(row: Row[Any]) -> WorkItem:
    return WorkItem(row.number, row.trial, row.author, date_of(row.made_at), _event(row.kind, row.content))


def _event(kind: str, text: str) -> WorkEvent:
    if kind not in KINDS:
        raise ReviewError(f"it is of the kind {kind[:40]!r}, written by a newer version; update addb-viewer")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ReviewError(f"its content is not JSON ({type(error).__name__})") from error
    form = KINDS[kind]
    known = {field.name for field in fields(form)}
    if not isinstance(content, dict) or not content.keys() <= known:
        raise ReviewError("it says what this version does not know; update addb-viewer")
    for name, value in content.items():
        whole_number = not isinstance(value, bool) or bool in _TYPES[name]
        if not (isinstance(value, _TYPES[name]) and whole_number) or (
            isinstance(value, str) and not is_text(value)
        ):
            raise ReviewError(f"its '{name}' is of a wrong type")
    try:
        return form(**content)
    except TypeError as error:
        raise ReviewError("it does not say all that it should; update addb-viewer") from error
