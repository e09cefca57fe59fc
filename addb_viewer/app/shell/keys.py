"""Keys and the command palette of one browser, bound to what they do; and the help page.

The page's own handler (`page/web/keys.js`) finds the command of a key ahead of viser's, and asks for its
action over the channel: `["do", action]`.
"""

import html
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import viser

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.shell.commands import Command, key_words
from addb_viewer.trial_view.html_pieces import boxed

Action = Callable[[], None]
ANSWERS = ("yes", "no", "help")  # actions that a question does not keep away


@dataclass(frozen=True)
class Acting:
    """What commands do at one browser."""

    actions: Mapping[str, Action]  # one for each command
    notices: Notices  # told what fails
    questions: Questions  # while one waits, nothing but its answer is done

    def of(self, action: str) -> Action:
        """What a command's action does; while a question waits, a digit chooses from what it offers."""

        def act() -> None:
            if action in ANSWERS or not self.questions.waits:
                self.actions[action]()
            else:
                self.questions.choose(action.removeprefix("flag_"))

        return act


def register(gui: viser.GuiApi, channel: Channel, commands: Sequence[Command], acting: Acting) -> None:
    """Bind every command to its action; they are done in the order of the keys.

    Args:
        gui: of the browser.
        channel: to the page's handler of keys.
        commands: with their keys.
        acting: what they do.
    """
    done = {c.action: (c.label, acting.of(c.action)) for c in commands}
    for command in commands:
        label, act = done[command.action]
        # Viser's type lists keys; its page takes any word, and shows it in the palette.
        word = cast(Any, _word(command) if command.keys else None)
        gui.add_command(label, hotkey=word).on_trigger(acting.notices.in_order(label, act))

    def asked(action: Any) -> None:
        if isinstance(action, str) and action in done:
            acting.notices.obey(*done[action])

    channel.on("do", asked)
    channel.show("keys", {key: _told(c) for c in commands for key in c.keys})


def _told(command: Command) -> dict[str, Any]:
    """What the page knows of a key; of one that steps, by how much: its cursor need not wait."""
    steps = {"frames": command.step_frames, "seconds": command.step_s}
    told = {"do": command.action, "held": command.held}
    return told | ({"steps": steps} if any(steps.values()) else {})


def help_html(commands: Sequence[Command]) -> str:
    """The keys and what they do, in as many columns as there is room for.

    Args:
        commands: with their keys.
    """
    entries = "".join(
        "<div style='break-inside:avoid;display:flex;gap:.8em;padding:.05em 0'>"
        f"<span style='flex:0 0 10.5em'>{_keys_html(c)}</span><span>{html.escape(c.label)}</span></div>"
        for c in commands
        if c.keys
    )
    return f"<div data-addb-wide style='columns:24em;column-gap:2em'>{entries}</div>"


def page_html(commands: Sequence[Command], file: str) -> str:
    """The help page: keys, and what the mouse does.

    Args:
        commands: with their keys.
        file: in which other keys can be chosen.
    """
    return boxed(
        f"{help_html(commands)}<p><b>Ctrl+K</b> lists all commands, also those without a key, and finds them "
        "by words. On a Mac, ⌘ does what Ctrl does. While a number or a text is typed, keys type; Enter or a "
        "click into the scene gives them back.</p>"
        "<p><b>Timeline:</b> a click goes to a frame, a drag selects a range, a number key flags it. "
        "<b>Scene:</b> drag turns, wheel zooms. <b>Lists:</b> a click goes there.</p>"
        "<p>Every decision is on the disk before you see it; labels do not ask: Undo takes them back.</p>"
        f"<p>Other keys: in <code>{html.escape(file)}</code>, read at the start, with lines such as "
        '<code>undo = ["U", "Ctrl+Z"]</code>; docs/reference/app.md has the names.</p>'
    )


def _keys_html(command: Command) -> str:
    return " or ".join(
        f"<b data-addb-key='{html.escape(key, quote=True)}'>{html.escape(key_words(key))}</b>"
        for key in command.keys
    )


def _word(command: Command) -> str:
    """Stands for a command on the page, where the palette shows it: "key t"; "+" would part it in two."""
    return f"key {key_words(command.keys[0])}".replace("+", "plus").lower()
