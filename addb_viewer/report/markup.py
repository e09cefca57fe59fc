"""Pieces of the report's HTML. Whatever comes from a file or a person is text, never markup."""

import html
import json
import re
from collections.abc import Iterable, Sequence

from addb_viewer.text.sections import Section, unbroken
from addb_viewer.trial_view.html_pieces import LISTS
from addb_viewer.trial_view.palette import Rgb

COMMAND = " To flag: "  # before each command that somebody may copy


class Safe(str):
    """HTML that was made here; everything else is escaped when it is put on the page."""

    __slots__ = ()


def text(content: str) -> Safe:
    """Any words as HTML: escaped unless they are `Safe`, `commands` set apart, units with their figures."""
    if isinstance(content, Safe):
        return content
    return Safe(re.sub("`([^`]+)`", r"<code>\1</code>", html.escape(unbroken(content))))


def element(tag: str, *content: str, **attributes: str) -> Safe:
    """An element with text or `Safe` pieces in it; `class_` and `data_seek` become `class`, `data-seek`."""
    named = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{html.escape(value)}"' for name, value in attributes.items()
    )
    return Safe(f"<{tag}{named}>{joined(content)}</{tag}>")


def joined(pieces: Iterable[str], between: str = "") -> Safe:
    """Pieces one after another."""
    return Safe(text(between).join(text(piece) for piece in pieces))


def part(anchor: str, heading: str, *content: str) -> Safe:
    """A part of the page with its heading, which links lead to."""
    return element("section", element("h2", heading), *content, id=anchor)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], class_: str = "") -> Safe:
    """A table whose first column names its rows; on narrow screens it scrolls by itself."""
    heads = joined(element("th", cell, scope="col") for cell in head)
    body = joined(
        element("tr", element("th", row[0], scope="row"), *(element("td", cell) for cell in row[1:]))
        for row in rows
    )
    return element(
        "div",
        element("table", element("thead", element("tr", heads)), element("tbody", body), class_=class_),
        class_="scroll",
    )


def pairs(rows: Iterable[tuple[str, str]]) -> Safe:
    """Labels and what belongs to them."""
    return element("dl", *(element("div", element("dt", a), element("dd", b)) for a, b in rows))


def told(section: Section, level: str = "h3") -> Safe:
    """A section of words under its heading."""
    lines = [element("p", line) for line in section.lines]
    rows = [pairs((label, _entries(label, words)) for label, words in section.rows)] if section.rows else []
    return element("div", element(level, section.heading), *lines, *rows, class_="told")


def _entries(label: str, words: str) -> Safe:
    """Words in which several entries, or several commands, get a line each."""
    between = "; " if label in LISTS else COMMAND
    first, *more = words.split(between)
    again = "" if between == "; " else COMMAND.strip() + " "
    return joined((first, *(again + entry for entry in more)), between=Safe("<br>"))


def bar(share: float, tone: str = "") -> Safe:
    """A bar as long as a share of its room; those who listen hear the figure beside it."""
    width = 100 * min(max(share, 0.0), 1.0)
    return Safe(f'<span class="bar {tone}" aria-hidden="true"><i style="width:{width:.1f}%"></i></span>')


def swatch(color: Rgb) -> Safe:
    """A small square of a colour."""
    return Safe(f'<i class="swatch" style="background:{color.on_any_page}"></i>')


def verdict_mark(within: bool | None) -> Safe:
    """A sign and a word, so that nobody has to tell colours apart."""
    if within is None:
        return element("span", "not computed", class_="mark unknown")
    return element("span", "✓ within" if within else "✗ beyond", class_=f"mark {'good' if within else 'bad'}")


def data_script(name: str, content: object) -> Safe:
    """Plain values for a script of the page; nothing in them can end the element."""
    plain = json.dumps(content, separators=(",", ":"), allow_nan=False)
    safe = plain.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return Safe(f'<script type="application/json" id="{html.escape(name)}">{safe}</script>')
