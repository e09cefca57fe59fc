"""Who is to review a trial, and what people say to each other about it: it decides nothing about forces.

These stand beside the edits of the review, in a log of their own: a comment makes no trial `in work`, is not
what undo takes back, and changes no fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from sqlalchemy import Connection

from annotations.events import IMPORTED, LONGEST_NAME
from annotations.reading import UnreadableRow
from annotations.review_errors import ReviewError
from annotations.schema import WORK
from annotations.subject_rows import SubjectRows, check_words

LONGEST_TEXT = 10_000  # characters of a comment


@dataclass(frozen=True)
class Assign:
    """A person is to review the trial."""

    person: str  # empty: nobody in particular any more

    def __post_init__(self) -> None:
        if self.person != self.person.strip() or len(self.person) > LONGEST_NAME:
            raise ReviewError(
                f"a name has at most {LONGEST_NAME} characters, and no blank at its beginning or end"
            )


@dataclass(frozen=True)
class Comment:
    """A word about the trial, or about one of its frames; or an answer to one."""

    text: str
    frame: int | None = None  # None: about the whole trial, or an answer
    answers: int | None = None  # number of the comment that began the talk; None: this one does

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ReviewError("a comment needs words")
        if len(self.text) > LONGEST_TEXT:
            raise ReviewError(f"a comment has at most {LONGEST_TEXT} characters")
        if self.frame is not None and self.frame < 0:
            raise ReviewError("frames are counted from 0")


@dataclass(frozen=True)
class Settle:
    """A talk is settled, or open again."""

    comment: int  # number of the one that began it
    settled: bool = True


WorkEvent = Assign | Comment | Settle


@dataclass(frozen=True)
class WorkItem:
    """One line of this log. Numbers grow with time, over all trials of a database."""

    number: int
    trial: str
    author: str
    made_at: datetime  # UTC
    event: WorkEvent


@dataclass(frozen=True)
class CommentThread:
    """A comment and its answers."""

    first: WorkItem
    answers: tuple[WorkItem, ...] = ()
    settled_by: str = ""  # empty: it is open

    @property
    def frame(self) -> int | None:
        """What it is about; None: the whole trial."""
        event = self.first.event
        return event.frame if isinstance(event, Comment) else None

    @property
    def number(self) -> int:
        """Of the comment that began it."""
        return self.first.number

    @property
    def people(self) -> tuple[str, ...]:
        """Who said something in it, in the order in which they first did."""
        return tuple(dict.fromkeys(item.author for item in (self.first, *self.answers)))


@dataclass(frozen=True)
class TrialWork:
    """The present state of a trial."""

    assigned_to: str = ""  # empty: nobody in particular
    assigned_by: str = ""
    comments: tuple[CommentThread, ...] = ()  # in the order in which they began

    @property
    def open_comments(self) -> int:
        """How many are not settled."""
        return sum(not thread.settled_by for thread in self.comments)


def work_of(items: Sequence[WorkItem]) -> TrialWork:
    """What a trial's items come to. An answer, or a settling, of what is not there says nothing.

    Args:
        items: of one trial, in order.
    """
    assigned_to = assigned_by = ""
    comments: dict[int, CommentThread] = {}
    for item in items:
        match item.event:
            case Assign(person):
                assigned_to, assigned_by = person, item.author
            case Comment(answers=None):
                comments[item.number] = CommentThread(item)
            case Comment(answers=int(first)) if first in comments:  # a word more opens it again
                comments[first] = CommentThread(comments[first].first, (*comments[first].answers, item))
            case Settle(first, settled) if first in comments:
                thread = comments[first]
                comments[first] = CommentThread(thread.first, thread.answers, item.author if settled else "")
    return TrialWork(assigned_to, assigned_by, tuple(comments.values()))


class WorkLog(SubjectRows):
    """Assignments and comments of one subject, in the database of its review.

    A row that cannot be read is passed over and stays as it is.
    """

    table = WORK
    kinds = {"assign": Assign, "comment": Comment, "settle": Settle}  # noqa: RUF012 (nobody changes it)

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
            if items:
                self._check_empty(connection, "comments")
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

    def _read(self, connection: Connection) -> tuple[tuple[WorkItem, ...], tuple[UnreadableRow, ...]]:
        return self._each(connection, self._wanted(), WorkItem)
