"""Rows of the log that are passed over: nobody can read what they decided, and people are told so."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeGuard


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
