"""Keys and the command palette of one browser, bound to what they do; and the help page.

The page's own handler (`page/web/keys.js`) finds the command of a key ahead of viser's, and asks for its
action over the channel: `["do", action]`.
"""

import html
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, cast

import viser

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.shell.commands import COMMANDS, Command, KeyNameError, key_name, key_words, with_keys
from addb_viewer.trial_view.html_pieces import boxed
from solver.common.errors import SolverError
from solver.common.small_files import BrokenFileError, lies_there, toml_tables


class KeyFileError(SolverError):
    """The file of keys cannot be used: file, line, what is wrong, and what to do."""


def key_file() -> Path:
    """Where the file is looked for: in the user's folder of configuration."""
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("APPDATA") or home / "AppData" / "Roaming")
    elif sys.platform == "darwin":
        base = home / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config")
    return base / "addb-viewer" / "keys.toml"


def chosen_commands(path: Path | None = None) -> tuple[Command, ...]:
    """All commands, with the keys of the file where there is one.

    Args:
        path: of the file; None: where it is looked for.

    Raises:
        KeyFileError: it cannot be read, or a line of it means nothing.
    """
    file = path or key_file()
    try:
        if not lies_there(file):
            return COMMANDS
        entries = toml_tables(file)
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, BrokenFileError) as error:
        raise KeyFileError(f"{file}: {error}") from error
    return with_keys(COMMANDS, _chosen(file, entries, lines))


def _chosen(file: Path, entries: Mapping[str, object], lines: list[str]) -> dict[str, tuple[str, ...]]:
    actions = [command.action for command in COMMANDS]
    chosen, used = dict[str, tuple[str, ...]](), dict[str, str]()
    for action, value in entries.items():
        where = f"{file}:{_line(lines, action)}"
        if action not in actions:
            near = ", ".join(get_close_matches(action, actions) or ["undo", "finish", "next"])
            raise KeyFileError(
                f"{where}: no command is called '{action}'. Nearest: {near}. "
                "docs/reference/app.md lists all, under Keys."
            )
        texts = value if isinstance(value, list) else [value]
        if not all(isinstance(text, str) for text in texts):
            raise KeyFileError(
                f"{where}: the keys of '{action}' are no texts. Write {action} = \"U\", several as "
                f'{action} = ["U", "Ctrl+Z"], none as {action} = [].'
            )
        try:
            keys = tuple(dict.fromkeys(key_name(str(text)) for text in texts))
        except KeyNameError as error:
            raise KeyFileError(f"{where}: {error}.") from error
        for key in keys:
            if key in used:
                raise KeyFileError(
                    f"{where}: {key_words(key)} is the key of '{used[key]}' already, in line "
                    f"{_line(lines, used[key])}. Give one of them another key."
                )
            used[key] = action
        chosen[action] = keys
    return chosen


def _line(lines: list[str], action: str) -> int:
    """The line, from 1, that begins with a name; 1 where none does."""
    begins = re.compile(rf"""\s*["']?{re.escape(action)}["']?\s*=""")
    return next((n for n, line in enumerate(lines, start=1) if begins.match(line)), 1)


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
    """The keys and what they do, in as many columns as there is room for."""
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
