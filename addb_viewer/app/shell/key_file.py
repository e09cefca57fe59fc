"""The file in which a person chooses other keys: one line a command, in TOML."""

import os
import re
import sys
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path

from addb_viewer.app.shell.commands import COMMANDS, Command, KeyNameError, key_name, key_words, with_keys
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
