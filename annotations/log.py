"""The review log of a subject: edits are appended and read back; nothing is ever changed or removed."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from sqlalchemy import Connection, Select, func, insert, select

from annotations.database import PATIENCE_S, Database
from annotations.errors import ReviewError
from annotations.event_codec import decoded, encoded, kind_of
from annotations.events import IMPORTED, Edit, Event, ImportLabels, ImportTable, Redo, Undo
from annotations.folding import folded
from annotations.schema import EDITS
from annotations.trial_review import TrialReview
from annotations.undoing import next_redo, next_undo, undo_of


class ReviewLog:
    """All edits of one subject.

    Several programs and threads may have the same log open: an edit is on the disk when `append` returns, and
    the next read by anybody finds it. Edits become visible in the order of their numbers.
    """

    def __init__(self, database: Database, subject: str) -> None:
        """Take part of a database that others may use as well; `close` leaves it open."""
        self._database = database
        self._subject = subject
        self._owns_database = False

    @classmethod
    def open(cls, where: Path | str, subject: str = "", patience_s: float = PATIENCE_S) -> Self:
        """Open a log, made where it is missing and brought to this version's schema where it is older.

        Args:
            where: an SQLite file, or a database's URL.
            subject: whose edits, in a database that holds several subjects.
            patience_s: how long to wait while another program writes [s].

        Raises:
            ReviewError: it cannot be opened, or a newer version made it.
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
            undone = next_undo(self._own(connection, trial, author), author)
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
            redone = next_redo(self._own(connection, trial, author), author)
            self._insert(connection, trial, author, Redo(redone.number))
        return redone

    def take_over(self, edits: Sequence[Edit]) -> int:
        """Copy the edits of another log, with their authors and dates, into this one, which is still empty.

        They get new numbers; undone ones stay undone.

        Args:
            edits: all of the other log's.

        Returns:
            How many.

        Raises:
            ReviewError: there are edits of this subject already, which the copies would contradict.
        """
        with self._database.writing() as connection:
            if connection.scalar(self._of_subject().limit(1)) is not None:
                raise ReviewError(
                    f"{self._database.name}: has edits of '{self._subject}' already; not copied"
                )
            number: dict[int, int] = {}
            for edit in edits:
                event = edit.event
                if isinstance(event, Undo | Redo):
                    event = replace(event, edit=number[event.edit])
                number[edit.number] = self._insert(connection, edit.trial, edit.author, event, edit.made_at)
        return len(edits)

    def history(self, trial: str | None = None) -> tuple[Edit, ...]:
        """The edits of a trial, or of all, in order."""
        with self._database.reading() as connection:
            return self._edits(connection, trial)

    def revision(self) -> int:
        """The number of the subject's last edit, whichever program made it; 0 where there is none."""
        last = select(func.max(EDITS.c.number)).where(EDITS.c.subject == self._subject)
        with self._database.reading() as connection:
            return connection.scalar(last) or 0

    def since(self, revision: int) -> tuple[Edit, ...]:
        """The edits after a revision, of all trials, in order.

        Args:
            revision: as `revision` gave it, or the number of an edit.
        """
        with self._database.reading() as connection:
            return _read(connection, self._of_subject().where(EDITS.c.number > revision))

    def last_import(self, trial: str, kind: type[ImportLabels | ImportTable]) -> Edit | None:
        """The last import of a kind into a trial, undone or not; None where there is none."""
        wanted = self._of_subject().where(EDITS.c.trial == trial, EDITS.c.kind == kind_of(kind))
        with self._database.reading() as connection:
            found = _read(connection, wanted.order_by(None).order_by(EDITS.c.number.desc()).limit(1))
        return found[0] if found else None

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
        return folded(trial, opinion(self.history(trial), by), feet)

    def _insert(
        self, connection: Connection, trial: str, author: str, event: Event, made_at: datetime | None = None
    ) -> int:
        kind, content = encoded(event)
        row = insert(EDITS).values(
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

    def _edits(self, connection: Connection, trial: str | None) -> tuple[Edit, ...]:
        wanted = self._of_subject()
        return _read(connection, wanted if trial is None else wanted.where(EDITS.c.trial == trial))

    def _own(self, connection: Connection, trial: str, author: str) -> tuple[Edit, ...]:
        """A person's edits of a trial, and the imports, which anybody may take back."""
        of_trial = self._of_subject().where(EDITS.c.trial == trial)
        return _read(connection, of_trial.where(EDITS.c.author.in_((author, IMPORTED))))

    def _of_subject(self) -> Select[Any]:
        return select(EDITS).where(EDITS.c.subject == self._subject).order_by(EDITS.c.number)


def opinion(edits: Sequence[Edit], by: str | None) -> tuple[Edit, ...]:
    """The edits that make one reviewer's opinion, on top of what was imported; all of them for None."""
    return tuple(edit for edit in edits if by is None or edit.author in (by, IMPORTED))


def _read(connection: Connection, wanted: Select[Any]) -> tuple[Edit, ...]:
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
    if (author == IMPORTED) is not isinstance(event, ImportLabels | ImportTable):
        raise ReviewError(f"'{IMPORTED}' stands for labels from files; a person needs another name")
