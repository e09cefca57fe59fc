"""Commands that are listed at once and loaded when somebody runs them: the libraries take seconds."""

import sys
from collections.abc import Iterable
from importlib import import_module
from typing import Any, Protocol

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

PACKAGE = "addb_viewer.commands"
STOPPED = 130  # by Ctrl-C, as shells count it


class _Command(Protocol):
    """What is used of a whole command."""

    params: list[Any]

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Read the arguments."""


class ListedCommand(TyperCommand):
    """A command by its name and its help's first sentence; the rest is in the module it comes from."""

    def __init__(self, name: str, function: str, first_sentence: str) -> None:
        """Nothing is loaded yet.

        Args:
            name: as people type it.
            function: MODULE:FUNCTION below `addb_viewer.commands`.
            first_sentence: the first of the function's docstring.
        """
        super().__init__(name, help=first_sentence)
        module, self.function = function.split(":")
        self.module = f"{PACKAGE}.{module}"

    def loaded(self) -> _Command:
        """The whole command, with its options."""
        alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        alone.command(name=self.name)(getattr(import_module(self.module), self.function))
        return get_command(alone)

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Load it and let it read its arguments; the context is that of the whole command."""
        try:
            whole = self.loaded()
        except KeyboardInterrupt:
            sys.stderr.write("addb-viewer: stopped; nothing was written\n")
            raise typer.Exit(STOPPED) from None
        return whole.make_context(info_name, args, parent=parent, **extra)


class ListedGroup(TyperGroup):
    """Commands below a name of their own."""

    def __init__(self, name: str, about: str, commands: Iterable[ListedCommand]) -> None:
        """Nothing is loaded yet.

        Args:
            name: as people type it, before the command's.
            about: what they are about, in a sentence.
            commands: listed below it.
        """
        super().__init__(
            name=name,
            help=about,
            commands={str(command.name): command for command in commands},
            no_args_is_help=True,
        )


def listing(commands: Iterable[ListedCommand | ListedGroup]) -> type[TyperGroup]:
    """The kind of group that has these commands."""
    by_name = {str(command.name): command for command in commands}

    class Listing(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings | {"commands": by_name})

    return Listing
