"""What can be written into the box "Go to", by a person or by the page's script."""

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class GoTo:
    """A frame."""

    frame: int


@dataclass(frozen=True)
class Select:
    """Frames start to end − 1."""

    start: int
    end: int


@dataclass(frozen=True)
class OpenRow:
    """A row of the queue, from 0."""

    row: int


@dataclass(frozen=True)
class Drop:
    """Nothing is to be selected any more."""


Wish = GoTo | Select | OpenRow | Drop


def wish(text: str) -> Wish | None:
    """What a text asks for; None while it is not, or not yet, a whole wish."""
    text = text.strip()
    if match := re.fullmatch(r"(\d{1,9})", text):
        return GoTo(int(match[1]))
    if match := re.fullmatch(r"(\d{1,9}):(\d{1,9})", text):
        start, end = int(match[1]), int(match[2])
        return Select(start, end) if start < end else None
    if match := re.fullmatch(r"#(\d{1,9})", text):
        return OpenRow(int(match[1]))
    if text == "-":
        return Drop()
    return None
