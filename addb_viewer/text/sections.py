"""A page for people in sections: headings, sentences, and rows of a label and a text."""

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

WIDTH = 96  # [characters] of a page
NO_BREAK = "\u00a0"  # a space that parts no line


@dataclass(frozen=True)
class Section:
    """A heading, sentences below it, and rows of a label and a text."""

    heading: str
    lines: tuple[str, ...] = ()
    rows: tuple[tuple[str, str], ...] = ()


def unbroken(text: str) -> str:
    """With figures that no line break parts from their units."""
    return re.sub(r"(?<=\d) (?=(?:%|×|°|N·m|N/|N|kg|mm|ms|m|s|Hz)(?![A-Za-z]))", NO_BREAK, text)


def as_text(sections: Sequence[Section], width: int = WIDTH) -> list[str]:
    """Sections as lines of a terminal."""
    lines = []
    for section in sections:
        kind, colon, what = section.heading.partition(":")
        lines.append(kind.upper() + colon + what)
        for text in section.lines:
            lines += _wrapped(text, width, "  ", "  ")
        label_width = max((len(label) for label, _ in section.rows), default=0)
        for label, text in section.rows:
            hanging = " " * (label_width + 4)
            first = f"  {label:<{label_width}}  "
            lines += _wrapped(text, width, first, hanging)
        lines.append("")
    return lines[:-1]


def _wrapped(text: str, width: int, first: str, hanging: str) -> list[str]:
    lines = textwrap.wrap(
        unbroken(text), width, initial_indent=first, subsequent_indent=hanging, break_on_hyphens=False
    )
    return [line.replace(NO_BREAK, " ") for line in lines]
