"""What was read of the log; people are told of rows that nobody can read and that are passed over."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeGuard

from annotations.events import Edit


@dataclass(frozen=True)
class UnreadableRow:
    """A row that cannot be read as an edit; it stays in the log as it is."""

    number: int
    trial: str  # empty where its name cannot be read; the row may then be about any trial
    author: str  # likewise
    why: str  # as a clause

    @property
    def name(self) -> str:
        """Which row, and whose."""
        return f"row {self.number}{f' by {self.author}' if self.author else ''}"

    def __str__(self) -> str:
        return (
            f"{self.name} of the review log cannot be read: {self.why}. Its decision does not count, and "
            "an edit that it had undone counts again; it stays in the log"
        )

    def may_be_about(self, trial: str) -> bool:
        """Whether it may have decided something about a trial.

        Args:
            trial: its name.
        """
        return self.trial in (trial, "")

    def may_be_of(self, *authors: str) -> bool:
        """Whether one of these may have written it.

        Args:
            authors: their names.
        """
        return not self.author or self.author in authors


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


def listed(rows: Sequence[UnreadableRow]) -> str:
    """Which rows, whose and of which trials, in a line.

    Args:
        rows: one at least.
    """
    return ", ".join(f"{row.name} of {row.trial or 'an unknown trial'}" for row in rows)


def is_text(value: object) -> TypeGuard[str]:
    """Whether a value is text that can be printed and written: bytes that are no UTF-8 are not.

    Args:
        value: of a row or of its JSON.
    """
    if not isinstance(value, str):
        return False
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True
