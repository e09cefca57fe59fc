"""The keys of the app: one table for the browser, the command palette, and the help.

Two scripts reach into the page of viser 1.1.1. Without them a click into the scene gives the keyboard back,
and keys, sliders and the box "Go to" do what clicks on the timeline do.
"""

import html
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, cast

import viser
from viser._messages import RunJavascriptMessage

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.style.html_pieces import boxed
from annotations.reasons import REASON_KEYS

Action = Callable[[], None]
ANSWERS = ("yes", "no")  # actions
SCRIPTS = ("release_focus.js", "timeline_bridge.js")


@dataclass(frozen=True)
class Command:
    """Something a key, or the command palette (Ctrl+K), does."""

    label: str
    action: str  # name in the table of actions that the app provides
    key: str | None = None  # as the browser names it
    shift: bool = False

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


def send_scripts(client: viser.ClientHandle) -> None:
    """Make keys work again right after a click, and clicks and drags work on the timeline and in lists."""
    for name in SCRIPTS:
        source = resources.files("addb_viewer.app.shell").joinpath(name).read_text(encoding="utf-8")
        client._websock_connection.queue_message(RunJavascriptMessage(source=source))


def register(
    gui: viser.GuiApi, actions: Mapping[str, Action], notices: Notices, questions: Questions
) -> None:
    """Bind every command to its action; they are done in the order of the keys.

    Args:
        gui: of the browser.
        actions: one for each command.
        notices: told what fails.
        questions: while one waits, nothing but its answer is done.
    """

    def unless_asked(command: Command) -> Action:
        def act() -> None:
            if command.action in ANSWERS or not questions.waits:
                actions[command.action]()

        return act

    for command in COMMANDS:
        handle = gui.add_command(
            command.label,
            # Viser's type lists fewer keys than its page takes: it hands the name on to the browser.
            hotkey=cast(Any, command.key),
            modifier="shift" if command.key and command.shift else None,
        )
        handle.on_trigger(notices.in_order(command.label, unless_asked(command)))


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
