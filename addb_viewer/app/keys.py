"""The keys of the app: one table for the browser, the command palette, and the help."""

import html
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import viser

from addb_viewer.app.notices import Notices

Action = Callable[[], None]


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
        names = {"space": "Space", "pageup": "Page up", "pagedown": "Page down", "home": "Home", "end": "End"}
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
    Command("Diagnose", "diagnose", "X"),
    Command("Accept the named causes", "accept"),
    Command("Reject the named causes", "reject"),
    Command("View from the front", "view_front"),
    Command("View from the side", "view_side"),
    Command("View from the top", "view_top"),
    Command("Reset the view", "view_reset"),
)


def register(
    gui: viser.GuiApi, at_once: Mapping[str, Action], later: Mapping[str, Action], notices: Notices
) -> None:
    """Bind every command to its action.

    Args:
        gui: where the commands go.
        at_once: actions that return immediately; they run in the order of the keys.
        later: actions that may take a while.
        notices: told what fails.
    """
    for command in COMMANDS:
        handle = gui.add_command(
            command.label,
            # Viser's type lists fewer keys than its page takes: it hands the name on to the browser.
            hotkey=cast(Any, command.key),
            modifier="shift" if command.key and command.shift else None,
        )
        if command.action in at_once:
            handle.on_trigger(notices.in_order(command.label, at_once[command.action]))
        else:
            handle.on_trigger(notices.guard(command.label, without_event(later[command.action])))


def without_event(action: Action) -> Callable[[object], None]:
    """For actions that need not know who asked."""
    return lambda _event: action()


def help_html() -> str:
    """The keys as a table."""
    rows = "".join(
        f"<tr><td style='padding-right:1em;white-space:nowrap'><b>{html.escape(c.shown)}</b></td>"
        f"<td>{html.escape(c.label)}</td></tr>"
        for c in COMMANDS
        if c.key
    )
    return f"<table>{rows}</table><p>All of them, searchable: Ctrl+K.</p>"
