"""Pieces of the page that several panels share."""

import html
from collections.abc import Sequence

from addb_viewer.trial_view.palette import Rgb

LISTS = (  # rows whose entries, parted by semicolons, get a line each
    "how large",
    "when",
    "could also be",
    "worst half second",
    "over time",
    "in which phase",
    "joint torques",
    "causes",
)
FIRST = ";opacity:.75"  # style of a table's first column


def boxed(content: str) -> str:
    """In the page's small type.

    Args:
        content: safe HTML.
    """
    return f"<div style='font-size:12px;line-height:1.4;padding:.15em .9em .15em .6em'>{content}</div>"


def range_words(start: int, end: int) -> str:
    """Frames start to end − 1 as lists have them, and as the box "Go to" takes them: "120–179"."""
    return f"{start}–{end - 1}"


def clickable(go_to: str, content: str) -> str:
    """A piece whose click writes something into the box "Go to".

    Args:
        go_to: as that box takes it.
        content: safe HTML.
    """
    return f"<div data-addb-go-to='{html.escape(go_to)}' style='cursor:pointer'>{content}</div>"


def swatch(color: Rgb, text: str = "") -> str:
    """A small square of a colour, with a sign on it: nobody has to tell colours apart."""
    return (
        "<span style='display:inline-block;min-width:1.1em;height:1.15em;line-height:1.15em;"
        "text-align:center;font-weight:700;border:1px solid gray;"
        f"background:{color.css};color:{color.ink.css}'>{html.escape(text)}</span>"
    )


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Text in rows and columns; the first column is paler."""
    heading = "".join(
        f"<th style='text-align:left;opacity:.75;font-weight:500;padding-right:.8em'>{html.escape(h)}</th>"
        for h in head
    )
    cells = "".join(
        "<tr>"
        + "".join(
            f"<td style='padding-right:.8em;vertical-align:top{FIRST if i == 0 else ''}'>"
            f"{html.escape(text)}</td>"
            for i, text in enumerate(row)
        )
        + "</tr>"
        for row in rows
    )
    return f"<table>{f'<tr>{heading}</tr>' if head else ''}{cells}</table>"
