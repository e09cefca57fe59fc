"""The review log of a subject: edits are appended and read back; nothing is ever changed or removed."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from sqlalchemy import Connection, insert, select

from annotations.database import Database
from annotations.errors import ReviewError
from annotations.event_codec import decoded, encoded
from annotations.events import IMPORTED, Edit, Event, ImportLabels, Redo, Undo
from annotations.folding import folded
from annotations.schema import EDITS
from annotations.trial_review import TrialReview
from annotations.undoing import next_redo, next_undo, undo_of


class ReviewLog:
    """All edits of one subject.

    Several programs and threads may have the same log open: an edit is on the disk when `append` returns, and
    the next read by anybody finds it.
    """

    def __init__(self, database: Database, subject: str) -> None:
        self._database = database
        self._subject = subject

    @classmethod
    def open(cls, where: Path | str, subject: str = "") -> Self:
        """Open a log, made where it is missing and brought to this version's schema where it is older.

        Args:
            where: an SQLite file, or a database's URL.
            subject: whose edits, in a database that holds several subjects.

        Raises:
            ReviewError: it cannot be opened, or a newer version made it.
        """
        return cls(Database(where), subject)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the database."""
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
            ReviewError: an author without a name, an undo of what cannot be undone, or a database that fails.
        """
        with self._database.writing() as connection, _about(trial):
            _check(event, author)
            if isinstance(event, Undo):
                undo_of(self._edits(connection, trial), event.edit, author)
            if (
                isinstance(event, Redo)
                and next_redo(self._edits(connection, trial), author).number != event.edit
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
            undone = next_undo(self._edits(connection, trial), author)
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
            redone = next_redo(self._edits(connection, trial), author)
            self._insert(connection, trial, author, Redo(redone.number))
        return redone

    def history(self, trial: str | None = None) -> tuple[Edit, ...]:
        """The edits of a trial, or of all, in order."""
        with self._database.reading() as connection:
            return self._edits(connection, trial)

    def trials(self) -> tuple[str, ...]:
        """Names of the trials that have edits."""
        of_subject = select(EDITS.c.trial).distinct().where(EDITS.c.subject == self._subject)
        with self._database.reading() as connection:
            return tuple(sorted(connection.scalars(of_subject)))

    def review(self, trial: str, feet: Sequence[str], by: str | None = None) -> TrialReview:
        """The present state of a trial's review.

        Args:
            trial: its name.
            feet: names of the subject's foot bodies.
            by: this reviewer's opinion alone, on top of what was imported; None for everybody's.

        Raises:
            ReviewError: an edit is about a foot that the subject does not have.
        """
        edits = self.history(trial)
        if by is not None:
            edits = tuple(edit for edit in edits if edit.author in (by, IMPORTED))
        return folded(trial, edits, feet)

    def _insert(self, connection: Connection, trial: str, author: str, event: Event) -> int:
        kind, content = encoded(event)
        row = insert(EDITS).values(
            subject=self._subject,
            trial=trial,
            author=author,
            made_at=datetime.now(UTC).isoformat(),
            kind=kind,
            content=content,
        )
        number = connection.execute(row).inserted_primary_key
        assert number is not None
        return int(number[0])

    def _edits(self, connection: Connection, trial: str | None) -> tuple[Edit, ...]:
        wanted = select(EDITS).where(EDITS.c.subject == self._subject).order_by(EDITS.c.number)
        if trial is not None:
            wanted = wanted.where(EDITS.c.trial == trial)
        return tuple(
            Edit(
                row.number,
                row.trial,
                row.author,
                datetime.fromisoformat(row.made_at),
                decoded(row.kind, row.content),
            )
            for row in connection.execute(wanted)
        )


@contextmanager
def _about(trial: str) -> Iterator[None]:
    """Name the trial in what goes wrong."""
    try:
        yield
    except ReviewError as error:
        raise ReviewError(f"{trial}: {error}") from error


def _check(event: Event, author: str) -> None:
    if not author.strip():
        raise ReviewError("an edit needs an author's name")
    if (author == IMPORTED) is not isinstance(event, ImportLabels):
        raise ReviewError(f"'{IMPORTED}' stands for labels from files; a person needs another name")
