"""The keys of the app: one table for the browser, the command palette, and the help.

The page's own handler (`page/web/keys.js`) finds the command of a key ahead of viser's, and asks for its
action over the channel: `["do", action]`.
"""

import html
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import viser

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.style.html_pieces import boxed
from annotations.reasons import REASON_KEYS

Action = Callable[[], None]
ANSWERS = ("yes", "no")  # actions
HELD = ("back_frame", "on_frame", "back_tenth", "on_tenth", "back_second", "on_second")  # repeat while held


@dataclass(frozen=True)
class Command:
    """Something a key, or the command palette (Ctrl+K), does."""

    label: str
    action: str  # name in the table of actions that the app provides
    key: str | None = None  # as the browser names it
    shift: bool = False

    @property
    def name(self) -> str:
        """The key as the page's handler writes it, with its modifiers: "Shift+PageUp", "T"."""
        names = {"pageup": "PageUp", "pagedown": "PageDown"}
        key = self.key or ""
        key = names.get(key, key.capitalize())
        return f"Shift+{key}" if self.shift else key

    @property
    def shown(self) -> str:
        """The key as people read it."""
        names = {
            "space": "Space",
            "pageup": "Page up",
            "pagedown": "Page down",
            "home": "Home",
            "end": "End",
            "enter": "Enter",
            "backspace": "Backspace",
            "escape": "Esc",
        }
        key = names.get(self.key or "", self.key or "")
        return f"Shift {key}" if self.shift else key


COMMANDS = (
    Command("Play or pause", "toggle", "space"),
    Command("One frame back", "back_frame", ","),
    Command("One frame on", "on_frame", "."),
    # Not Shift with comma and period: what those make differs between keyboards.
    Command("0.1 s back", "back_tenth", "pageup", shift=True),
    Command("0.1 s on", "on_tenth", "pagedown", shift=True),
    Command("1 s back", "back_second", "pageup"),
    Command("1 s on", "on_second", "pagedown"),
    Command("First frame", "first", "home"),
    Command("Last frame", "last", "end"),
    Command("Slower, or play backwards", "slower", "J"),
    Command("Stop", "stop", "K"),
    Command("Play, or faster", "faster", "L"),
    Command("Start of a range", "range_start", "I"),
    Command("End of a range", "range_end", "O"),
    *(Command(f"Flag: {key.words}", f"paint_{key.key}", key.key) for key in REASON_KEYS),
    Command("Clear: the force counts", "paint_0", "0"),
    Command("Foot: right, left, both", "foot", "F"),
    Command("Next proposal or flagged range", "next", "N"),
    Command("Previous proposal or flagged range", "previous", "P"),
    Command("Accept the proposal", "accept_proposal", "enter"),
    Command("Reject the proposal", "reject_proposal", "backspace"),
    Command("Undo", "undo", "U"),
    Command("Redo", "redo", "R"),
    Command("Yes, to the question", "yes", "Y"),
    Command("No, to the question", "no", "escape"),
    Command("Solve again", "solve", "G"),
    Command("Diagnose", "diagnose", "X"),
    Command("Compare with the previous solve", "compare", "M"),
    Command("Finish the trial, go to the next", "finish", "T"),
    Command("What if this range were flipped", "what_if"),
    Command("Keep the new solve", "keep"),
    Command("Discard the new solve", "discard"),
    Command("Cancel what is at work", "cancel"),
    Command("Needs a second look", "second_look"),
    Command("Accept the named causes", "accept"),
    Command("Reject the named causes", "reject"),
    Command("Write a report of the fit", "report"),
    Command("Record the fit for rerun", "record_rrd"),
    Command("Record the fit as MCAP", "record_mcap"),
    Command("Log the session, or no longer", "log"),
    Command("View from the front", "view_front"),
    Command("View from the side", "view_side"),
    Command("View from the top", "view_top"),
    Command("Reset the view", "view_reset"),
    Command("Dark or light", "theme"),
    Command("Change your name", "rename"),
)


def register(
    gui: viser.GuiApi,
    channel: Channel,
    actions: Mapping[str, Action],
    notices: Notices,
    questions: Questions,
) -> None:
    """Bind every command to its action; they are done in the order of the keys.

    Args:
        gui: of the browser.
        channel: to the page's handler of keys.
        actions: one for each command.
        notices: told what fails.
        questions: while one waits, nothing but its answer is done.
    """
    done = {c.action: (c.label, _unless_asked(c.action, actions[c.action], questions)) for c in COMMANDS}
    for command in COMMANDS:
        label, act = done[command.action]
        # Viser's type lists keys; its page takes any word, and shows it in the palette.
        shown = cast(Any, f"key {command.shown}".replace("+", "plus").lower()) if command.key else None
        gui.add_command(label, hotkey=shown).on_trigger(notices.in_order(label, act))

    def asked(action: Any) -> None:
        if isinstance(action, str) and action in done:
            notices.obey(*done[action])

    channel.on("do", asked)
    channel.show(
        "keys", {c.name: {"do": c.action, "held": c.action in HELD} for c in COMMANDS if c.key is not None}
    )


def _unless_asked(action: str, act: Action, questions: Questions) -> Action:
    def acted() -> None:
        if action in ANSWERS or not questions.waits:
            act()

    return acted


def help_html() -> str:
    """The keys as a table."""
    rows = "".join(
        f"<tr><td style='padding-right:1em;white-space:nowrap'><b>{html.escape(c.shown)}</b></td>"
        f"<td>{html.escape(c.label)}</td></tr>"
        for c in COMMANDS
        if c.key
    )
    return f"<table>{rows}</table>"


def page_html() -> str:
    """The help page: keys, and what the mouse does."""
    return boxed(
        "<b>Keys</b>"
        + help_html()
        + "<p><b>Ctrl+K</b> lists all of them and what has no key, searchable. While a number or a text is "
        "typed, keys type; Enter or a click into the scene gives them back.</p>"
        "<p><b>Timeline:</b> a click goes to a frame, a drag selects a range, a number key paints it. "
        "<b>Scene:</b> drag turns, wheel zooms. <b>Lists:</b> a click goes there.</p>"
        "<p>Every decision is on the disk before you see it; labels do not ask back, as U takes them back. "
        "Questions take Y for yes and Esc for no; else Esc drops the selection and closes failures.</p>"
    )
