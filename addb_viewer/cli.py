"""The command line: one module a command, put together here."""

import os
import sys
from importlib.metadata import version
from typing import Annotated

import typer

from addb_viewer.commands.ablation import ablation
from addb_viewer.commands.accept import accept, reject
from addb_viewer.commands.agreement import agreement
from addb_viewer.commands.demo import demo
from addb_viewer.commands.detect import detect
from addb_viewer.commands.diagnose import diagnose
from addb_viewer.commands.export import export
from addb_viewer.commands.fit import fit
from addb_viewer.commands.flag import flag
from addb_viewer.commands.flags import flags
from addb_viewer.commands.init import init
from addb_viewer.commands.label import label
from addb_viewer.commands.mark import mark
from addb_viewer.commands.markers import markers
from addb_viewer.commands.open import open_subject
from addb_viewer.commands.record import record
from addb_viewer.commands.recover import recover, restore
from addb_viewer.commands.report import report
from addb_viewer.commands.settings import settings
from addb_viewer.commands.share import share
from addb_viewer.commands.undo import redo, undo
from addb_viewer.review_store import STORE

app = typer.Typer(
    name="addb-viewer",
    help="Markers and force plates in, a skeleton that obeys F = ma out; reviewed in the browser.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command(name="demo")(demo)
app.command(name="open")(open_subject)
app.command(name="init")(init)
app.command(name="fit")(fit)
app.command(name="markers")(markers)
app.command(name="detect")(detect)
app.command(name="diagnose")(diagnose)
app.command(name="accept")(accept)
app.command(name="reject")(reject)
app.command(name="export")(export)
app.command(name="record")(record)
app.command(name="report")(report)
app.command(name="recover")(recover)
app.command(name="restore")(restore)
app.command(name="flag")(flag)
app.command(name="flags")(flags)
app.command(name="undo")(undo)
app.command(name="redo")(redo)
app.command(name="mark")(mark)
app.command(name="agreement")(agreement)
app.command(name="label")(label)
app.command(name="share")(share)
app.command(name="ablation")(ablation)
app.command(name="settings")(settings)


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
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal without '²' still gets its table
    app()
