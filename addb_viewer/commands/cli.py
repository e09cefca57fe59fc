"""The command line: one module a command, listed here and loaded when it is run."""

import codecs
import os
import sys
from importlib.metadata import version
from typing import Annotated

import typer

from addb_viewer.commands.listed import ListedCommand, ListedGroup, listing
from addb_viewer.jobs.environment import STORE, end_with_parent

DATASET = (
    ListedCommand(
        "build",
        "dataset.build:build",
        "Make a release of all subjects below some folders, or bring it up to date.",
    ),
    ListedCommand(
        "show",
        "dataset.show:show",
        "Say what a release holds; or of a trial where its numbers come from.",
    ),
    ListedCommand(
        "split",
        "dataset.split:split",
        "Say which persons of a release are for training, development and test.",
    ),
    ListedCommand(
        "stats",
        "dataset.stats:stats",
        "Write the dataset paper's tables and figures of a release, and a page that holds them all.",
    ),
    ListedCommand(
        "check",
        "dataset.check:check",
        "Say what is wrong with a release: files, schema, F = ma, torques, plausibility, duplicates, splits.",
    ),
    ListedCommand(
        "synthesize",
        "dataset.synthesize:synthesize",
        "Make up a corpus of people, faults and traps, and keep the truth about it aside.",
    ),
)
BENCHMARK = (
    ListedCommand(
        "train",
        "benchmark.train:train",
        "Let predictors learn from a release's training persons.",
    ),
    ListedCommand(
        "evaluate",
        "benchmark.evaluate:evaluate",
        "Hold predictors against the forces of persons whom they have not seen.",
    ),
    ListedCommand(
        "sweep",
        "benchmark.sweep:sweep",
        "Draw the error of the total force against the filter's cutoff.",
    ),
    ListedCommand(
        "table",
        "benchmark.table:table",
        "Print results as a table, the paper's beside them.",
    ),
)
COMMANDS = (
    ListedCommand(
        "demo",
        "demo:demo",
        "Make the demo subject, fit it, say what is wrong with it, and open the app on it.",
    ),
    ListedCommand(
        "open",
        "open:open_subject",
        "Open the review app; subjects without a fit show what was measured.",
    ),
    ListedCommand(
        "init",
        "init:init",
        "Write a subject.toml that says what was understood, commented, for you to correct.",
    ),
    ListedCommand(
        "fit",
        "fit:fit",
        "Fit the skeleton to a subject's recordings, keep the results and print the summary.",
    ),
    ListedCommand(
        "markers",
        "markers:markers",
        "Print how each label is understood, how sure that is, and write a map that you can correct.",
    ),
    ListedCommand(
        "detect",
        "detect:detect",
        "List the frames whose force is missing or wrong: which foot's, why, and how sure that is.",
    ),
    ListedCommand(
        "diagnose",
        "diagnose:diagnose",
        "Say what is wrong with the recordings, name the cause, and say how sure that is.",
    ),
    ListedCommand(
        "accept",
        "accept:accept",
        "Accept the causes of the last diagnosis: from now on fits use them beside the recorded forces.",
    ),
    ListedCommand(
        "reject",
        "accept:reject",
        "Reject the causes of the last diagnosis: from now on fits use the recorded forces alone.",
    ),
    ListedCommand(
        "export",
        "export:export",
        "Write the fit for other tools into the results folder; solve first where none is kept.",
    ),
    ListedCommand(
        "convert",
        "convert:convert",
        "Write what a file holds in another format, without a fit; says what the other cannot hold.",
    ),
    ListedCommand(
        "record",
        "record:record",
        "Record the fit for rerun or Foxglove; solve first where none is kept.",
    ),
    ListedCommand(
        "report",
        "report:report",
        "Write a page that says how good a fit is, on which frames, and why not on others.",
    ),
    ListedCommand(
        "flag",
        "flag:flag",
        "Flag frames of a trial whose force is missing or wrong; the next fit leaves it out.",
    ),
    ListedCommand(
        "flags",
        "flags:flags",
        "List the flagged ranges of a subject, who flagged them, and where reviewers disagree.",
    ),
    ListedCommand("undo", "undo:undo", "Take back your last edit of a trial, or the one with that number."),
    ListedCommand("redo", "undo:redo", "Let the edit that you undid last count again."),
    ListedCommand(
        "mark",
        "mark:mark",
        "Say how far the review of a trial has come; once it is finished, detection changes nothing in it.",
    ),
    ListedCommand(
        "agreement",
        "agreement:agreement",
        "Compare two reviewers' flags, and activities, on the trials that both have judged.",
    ),
    ListedCommand(
        "label", "label:label", "Take in a table of labels; they count wherever nobody has decided here."
    ),
    ListedCommand(
        "share",
        "share:share",
        "Copy a subject's edits from its own file into the shared database, authors and dates included.",
    ),
    ListedCommand(
        "ablation",
        "ablation:ablation",
        "Hide the forces of right steps, fit without them, and compare with the fit that sees them.",
    ),
    ListedCommand(
        "settings",
        "settings:settings",
        "Print the settings as TOML; copy what you change into SUBJECT/settings.toml.",
    ),
    ListedGroup("dataset", "Make a release of many subjects for machine learning, and describe it.", DATASET),
    ListedGroup(
        "benchmark", "Tell forces from motion alone on a release, and how well that works.", BENCHMARK
    ),
)

app = typer.Typer(
    cls=listing(COMMANDS),
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
