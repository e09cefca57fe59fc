"""The command line: commands are listed here and loaded when they are run."""

import codecs
import os
import sys
from importlib import import_module
from importlib.metadata import version
from typing import Annotated, Any, Protocol

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from addb_viewer.jobs.environment import STORE, end_with_parent

PACKAGE = "addb_viewer.commands"
STOPPED = 130  # by Ctrl-C, as shells count it

COMMANDS = {
    "open": {
        "demo": "Make the demo subject, fit it, say what is wrong with it, and open the app on it.",
        "open": "Open the review app; subjects without a fit show what was measured.",
    },
    "watch": {
        "watch": "Say what each trial is good for, and what to do now, as soon as it is recorded.",
    },
    "describe": {
        "init": "Write a subject.toml that says what was understood, commented, for you to correct.",
        "markers": "Print how each label is understood, how sure that is, and write a map that you can "
        "correct.",
        "settings": "Print the settings as TOML; copy what you change into SUBJECT/settings.toml.",
    },
    "fit": {
        "fit": "Fit the skeleton to a subject's recordings, keep the results and print the summary.",
    },
    "diagnose": {
        "detect": "List the frames whose force is missing or wrong: which foot's, why, and how sure that is.",
        "diagnose": "Say what is wrong with the recordings, name the cause, and say how sure that is.",
        "accept": "Accept the causes of the last diagnosis: from now on fits use them beside the "
        "recorded forces.",
        "reject": "Reject the causes of the last diagnosis: from now on fits use the recorded forces alone.",
    },
    "export": {
        "export": "Write the fit for other tools into the results folder; solve first where none is kept.",
        "convert": "Write what a file holds in another format, without a fit; says what the other cannot "
        "hold.",
        "record": "Record the fit for rerun or Foxglove; solve first where none is kept.",
    },
    "report": {
        "report": "Write a page that says how good a fit is, on which frames, and why not on others.",
    },
    "decide": {
        "flag": "Flag frames of a trial whose force is missing or wrong; the next fit leaves it out.",
        "undo": "Take back your last edit of a trial, or the one with that number.",
        "redo": "Let the edit that you undid last count again.",
        "mark": "Say how far the review of a trial has come; once it is finished, detection changes "
        "nothing in it.",
        "label": "Take in a table of labels; they count wherever nobody has decided here.",
        "share": "Copy a subject's edits from its own file into the shared database, authors and dates "
        "included.",
    },
    "flags": {
        "flags": "List the flagged ranges of a subject, who flagged them, and where reviewers disagree.",
        "agreement": "Compare two reviewers' flags, and activities, on the trials that both have judged.",
    },
    "ablation": {
        "ablation": "Hide the forces of right steps, fit without them, and compare with the fit that "
        "sees them.",
    },
}
"""First sentence of each command's help, by module below `addb_viewer.commands` and by function."""

GROUPS = {
    "dataset": {
        "build": "Make a release of all subjects below some folders, or bring it up to date.",
        "show": "Say what a release holds; or of a trial where its numbers come from.",
        "split": "Say which persons of a release are for training, development and test.",
        "stats": "Write the dataset paper's tables and figures of a release, and a page that holds them all.",
        "check": "Say what is wrong with a release: files, schema, F = ma, torques, plausibility, "
        "duplicates, splits.",
        "synthesize": "Make up a corpus of people, faults and traps, and keep the truth about it aside.",
    },
    "benchmark": {
        "train": "Let predictors learn from a release's training persons.",
        "evaluate": "Hold predictors against the forces of persons whom they have not seen.",
        "sweep": "Draw the error of the total force against the filter's cutoff.",
        "table": "Print results as a table, the paper's beside them.",
    },
}
"""Likewise of the commands that stand below a name of their own, that of their module."""

ABOUT_GROUPS = {
    "dataset": "Make a release of many subjects for machine learning, and describe it.",
    "benchmark": "Tell forces from motion alone on a release, and how well that works.",
}


class _Command(Protocol):
    """What is used of a whole command."""

    params: list[Any]

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Read the arguments."""


class ListedCommand(TyperCommand):
    """A command by its name and its help's first sentence; the rest is in the module it comes from."""

    def __init__(self, module: str, name: str, first_sentence: str) -> None:
        """Nothing is loaded yet.

        Args:
            module: below `addb_viewer.commands`.
            name: as people type it, and of the function.
            first_sentence: the first of the function's docstring.
        """
        super().__init__(name, help=first_sentence)
        self.module, self.function = f"{PACKAGE}.{module}", name

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


def _group(name: str) -> TyperGroup:
    commands: dict[str, Any] = {own: ListedCommand(name, own, about) for own, about in GROUPS[name].items()}
    return TyperGroup(name=name, help=ABOUT_GROUPS[name], commands=commands, no_args_is_help=True)


class Listing(TyperGroup):
    """All commands, in order."""

    def __init__(self, **settings: Any) -> None:
        """Nothing is loaded yet."""
        commands: dict[str, Any] = {
            name: ListedCommand(module, name, about)
            for module, own in COMMANDS.items()
            for name, about in own.items()
        }
        commands |= {name: _group(name) for name in GROUPS}
        super().__init__(**settings | {"commands": commands})


app = typer.Typer(
    cls=Listing,
    name="addb-viewer",
    help="Markers and force plates in, a skeleton that obeys F = ma out; reviewed in the browser.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"addb-viewer {version('addb-viewer')}")
        raise typer.Exit


def _name_store(url: str | None) -> None:
    """Every command reads it there, and so do the processes that it starts."""
    if url is not None:
        os.environ[STORE] = url


@app.callback()
def _options(
    _store: Annotated[
        str | None,
        typer.Option(
            "--store",
            metavar="URL",
            envvar=STORE,
            show_envvar=True,
            callback=_name_store,
            help="Database that several people keep their reviews in; a file in each subject by default.",
        ),
    ] = None,
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and stop."),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line on `sys.argv`."""
    end_with_parent()
    codecs.register_error(_shown.__name__, _shown)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=_shown.__name__)
    app()


def _shown(error: UnicodeError) -> tuple[bytes, int]:
    """A terminal without '²' still gets its table, and the names of files whatever bytes they are."""
    assert isinstance(error, UnicodeEncodeError)
    from solver.common.file_names import readable  # noqa: PLC0415 (help needs nothing of the solver)

    text = readable(error.object[error.start : error.end])
    return text.encode(error.encoding, errors="replace"), error.end
