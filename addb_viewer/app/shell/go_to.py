"""Where a person wants to go: by the box "Go to", and by clicks and drags on timeline, charts and lists."""

import re
from dataclasses import dataclass
from typing import Any

from addb_viewer.app.page.handles import put
from addb_viewer.app.shell.session import Session
from addb_viewer.trial_view.frame_ranges import Stop

LARGEST_PX = 1e5  # of a picture that a page tells


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


Entry = GoTo | Select | OpenRow | Drop


def entry(text: str) -> Entry | None:
    """What a text in the box asks for; None while it is not, or not yet, whole."""
    text = text.strip()
    if match := re.fullmatch(r"(\d{1,9})", text):
        return GoTo(int(match[1]))
    if match := re.fullmatch(r"(\d{1,9})\s*([-–:])\s*(\d{1,9})", text):
        start, last = int(match[1]), int(match[3])
        end = last if match[2] == ":" else last + 1  # a colon is that of the command line
        return Select(start, end) if start < end else None
    if match := re.fullmatch(r"#(\d{1,9})", text):
        return OpenRow(int(match[1]))
    if text == "-":
        return Drop()
    return None


def listen(s: Session) -> None:
    """Obey what is clicked and dragged on the page's own parts."""

    def went(text: Any) -> None:
        if isinstance(text, str):
            s.notices.obey("Going there", lambda: go_to(s, text))

    def moved(border: Any) -> None:
        match border:
            case {"start": int(start), "end": int(end), "foot": str() | None as foot, "to": [int(a), int(b)]}:
                flag = (start, end, foot)
                s.notices.obey("Moving the border", lambda: _move_border(s, flag, (a, b)))

    def chosen(block: Any) -> None:
        match block:
            case {"start": int(start), "end": int(end), "foot": str() | None as foot} if 0 <= start < end:
                s.notices.obey("Selecting", lambda: s.review.go_to((start, end, foot)))

    def resized(size: Any) -> None:
        match size:
            case [int() | float() as width, int() | float() as height] if s.picture != (width, height):
                if 0 < width < LARGEST_PX and 0 < height < LARGEST_PX:
                    s.picture = (width, height)
                    s.playback.redraw()

    s.channel.on("picture", resized)
    s.channel.on("go_to", went)
    s.channel.on("select", chosen)
    s.channel.on("border", moved)


def _move_border(s: Session, flag: Stop, to: tuple[int, int]) -> None:
    if s.replay is not None and 0 <= to[0] < to[1] <= s.replay.frames:
        s.review.move_border(flag, to)


def go_to(s: Session, text: str) -> None:
    """Do what was clicked, or written into the box; while it is not whole, nothing."""
    match entry(text):
        case GoTo(frame):
            s.review.drop(only_whole=True)
            s.seek(frame)
        case Drop():
            put(s.controls.go_to, "")
            s.review.drop(only_whole=True)
        case Select(start, end):
            s.review.select(start, end)
            s.review.warm_up()
        case OpenRow(row):
            s.queue.open_row(row)
