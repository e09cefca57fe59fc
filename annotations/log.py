"""The review log of a subject: edits are appended and read back; nothing is ever changed or removed."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from sqlalchemy import Connection, select

from annotations.database import PATIENCE_S, Database
from annotations.event_codec import kind_of
from annotations.events import IMPORTED, Edit, Event, ImportLabels, ImportTable, Redo, Undo
from annotations.folding import folded
from annotations.reading import Reading, UnreadableRow, is_text
from annotations.review_errors import ReviewError
from annotations.schema import EDITS
from annotations.subject_rows import SubjectRows, check_author, check_words
from annotations.trial_review import TrialReview
from annotations.undoing import next_redo, next_undo, undo_of
from annotations.work import WorkLog


class ReviewLog(SubjectRows):
    """All edits of one subject.

    Several programs and threads may have the same log open: an edit is on the disk when `append` returns, and
    the next read by anybody finds it. Edits become visible in the order of their numbers. A row that cannot
    be read as an edit is passed over and stays as it is; `unreadable` tells which.
    """

    def __init__(self, database: Database, subject: str) -> None:
        """Take part of a database that others may use as well; `close` leaves it open."""
        super().__init__(database, subject)
        self.work = WorkLog(database, subject)  # who is to review what, and comments
        self._owns_database = False

    @classmethod
    def open(cls, where: Path | str, subject: str = "", patience_s: float = PATIENCE_S) -> Self:
        """Open a log, made where it is missing.

        Args:
            where: an SQLite file, or a database's URL.
            subject: whose edits, in a database that holds several subjects.
            patience_s: how long to wait while another program writes [s].

        Raises:
            ReviewError: it cannot be opened, or another version made it.
        """
        log = cls(Database(where, patience_s), subject)
        log._owns_database = True
        return log

    @property
    def file(self) -> Path | None:
        """The SQLite file that it is written to; None for a server, or a file that can only be read."""
        return self._database.file

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the database that was opened for this log."""
        if self._owns_database:
            self._database.close()

    def append(self, trial: str, event: Event, author: str) -> int:
        """Record an edit; it is on the disk when this returns.

        Args:
            trial: its name.
            event: what the edit says.
            author: who makes it; labels from files are the reviewer `imported`'s.

        Returns:
            The edit's number.

        Raises:
            ReviewError: an author without a name, words that cannot be kept, an undo of what cannot be
                undone, or a database that fails.
        """
        with self._database.writing() as connection, _about(trial):
            check_author(event, author)
            check_words(trial, author, event)
            if isinstance(event, Undo | Redo):
                found = self._read(connection, trial)
            if isinstance(event, Undo):
                undo_of(found.edits, event.edit, author, found.unreadable)
            if (
                isinstance(event, Redo)
                and next_redo(found.edits, author, found.unreadable).number != event.edit
            ):
                raise ReviewError(f"edit {event.edit} is not the one that {author} undid last")
            return self._insert(connection, trial, author, event)

    def undo(self, trial: str, author: str) -> Edit:
        """Take back the author's last edit of the trial that counts.

        Returns:
            The edit that no longer counts.

        Raises:
            ReviewError: there is none.
        """
        with self._database.writing() as connection, _about(trial):
            found = self._read(connection, trial)
            undone = next_undo(found.edits, author, found.unreadable)
            self._insert(connection, trial, author, Undo(undone.number))
        return undone

    def redo(self, trial: str, author: str) -> Edit:
        """Let the edit that the author undid last count again.

        Returns:
            That edit.

        Raises:
            ReviewError: there is none.
        """
        with self._database.writing() as connection, _about(trial):
            found = self._read(connection, trial)
            redone = next_redo(found.edits, author, found.unreadable)
            self._insert(connection, trial, author, Redo(redone.number))
        return redone

    def take_over(self, edits: Sequence[Edit]) -> int:
        """Copy the edits of another log, with their authors and dates, into this one, which is still empty.

        They get new numbers; undone ones stay undone. To take back, or let count again, an edit that is not
        among them says nothing any more, and is left out.

        Args:
            edits: all of the other log's that can be read.

        Returns:
            How many were copied.

        Raises:
            ReviewError: there are edits of this subject already, which the copies would contradict.
        """
        with self._database.writing() as connection:
            self._check_empty(connection, "edits")
            number: dict[int, int] = {}
            for edit in edits:
                event = edit.event
                if isinstance(event, Undo | Redo):
                    if event.edit not in number:
                        continue
                    event = replace(event, edit=number[event.edit])
                number[edit.number] = self._insert(connection, edit.trial, edit.author, event, edit.made_at)
        return len(number)

    def reading(self, trial: str | None = None, after: int | None = None) -> Reading:
        """Edits, and the rows among them that cannot be read.

        Args:
            trial: of this one; None: of all, with the rows whose trial cannot be read.
            after: behind the row of this number; None: all.
        """
        with self._database.reading() as connection:
            return self._read(connection, trial, after)

    def history(self, trial: str | None = None) -> tuple[Edit, ...]:
        """The edits of a trial, or of all, in order."""
        return self.reading(trial).edits

    def unreadable(self, trial: str | None = None) -> tuple[UnreadableRow, ...]:
        """The rows that are passed over because they cannot be read, in order; of a trial, or of all."""
        return self.reading(trial).unreadable

    def last_import(self, trial: str, kind: type[ImportLabels | ImportTable]) -> Edit | None:
        """The last import of a kind into a trial that can be read, undone or not; None: there is none."""
        wanted = self._wanted().where(EDITS.c.trial == trial, EDITS.c.kind == kind_of(kind))
        with self._database.reading() as connection:
            found, _ = self._each(connection, wanted, _edit)
        return found[-1] if found else None

    def trials(self) -> tuple[str, ...]:
        """Names of the trials that have rows, which can be read or not."""
        of_subject = select(EDITS.c.trial).distinct().where(EDITS.c.subject == self._subject)
        with self._database.reading() as connection:
            return tuple(sorted(name for name in connection.scalars(of_subject) if is_text(name)))

    def review(self, trial: str, feet: Sequence[str], by: str | None = None) -> TrialReview:
        """The present state of a trial's review.

        Args:
            trial: its name.
            feet: names of the subject's foot bodies.
            by: this reviewer's opinion alone, on top of what was imported; None for everybody's.

        Raises:
            ReviewError: an edit is about a foot that the subject does not have.
        """
        found = self.reading(trial)
        return review_of(trial, found.edits, found.unreadable, feet, by)

    def _read(self, connection: Connection, trial: str | None, after: int | None = None) -> Reading:
        wanted = self._wanted()
        if trial is not None:
            wanted = wanted.where(EDITS.c.trial == trial)
        if after is not None:
            wanted = wanted.where(EDITS.c.number > after)
        return Reading(*self._each(connection, wanted, _edit))


def review_of(
    trial: str,
    edits: Sequence[Edit],
    unreadable: Sequence[UnreadableRow],
    feet: Sequence[str],
    by: str | None = None,
) -> TrialReview:
    """The state that a trial's rows make: of all reviewers, or one's opinion on top of what was imported.

    Args:
        trial: its name.
        edits: of the trial, in order.
        unreadable: rows that may be about it.
        feet: names of the subject's foot bodies.
        by: the one reviewer; None for everybody.

    Raises:
        ReviewError: an edit is about a foot that the subject does not have.
    """
    if by is not None:
        edits = [edit for edit in edits if edit.author in (by, IMPORTED)]
        unreadable = [row for row in unreadable if row.may_be_of(by, IMPORTED)]
    return folded(trial, edits, feet, unreadable)


def _edit(number: int, trial: str, author: str, made_at: datetime, event: Event) -> Edit:
    if number < 1:
        raise ReviewError("numbers begin at 1")
    check_author(event, author)
    return Edit(number, trial, author, made_at, event)


@contextmanager
def _about(trial: str) -> Iterator[None]:
    """Name the trial in what goes wrong."""
    try:
        yield
    except ReviewError as error:
        raise ReviewError(f"{trial}: {error}") from error
