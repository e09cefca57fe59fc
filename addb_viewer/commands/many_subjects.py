"""What the commands that take many subjects share: their options, and how they end."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.many import Work, done_to_all, write_outcomes
from addb_viewer.commands.many_table import Status, print_table
from addb_viewer.commands.options import replaceable
from addb_viewer.jobs.errors import FAILED, STOPPED
from addb_viewer.jobs.root_folder import RootFolder
from solver.capture.formats.b3d.places import subject_folder_of

SubjectOrRoot = Annotated[
    Path,
    typer.Argument(
        metavar="SUBJECT",
        help="A subject's folder, a .b3d file, or a folder of several subjects.",
        callback=subject_folder_of,
    ),
]
Jobs = Annotated[
    int, typer.Option("--jobs", metavar="N", help="Of several subjects, how many at a time.", min=1)
]
CsvFile = Annotated[
    Path | None,
    typer.Option(
        "--csv",
        metavar="FILE",
        help="Of several subjects, write a line each as CSV.",
        dir_okay=False,
        callback=replaceable,
    ),
]


def check_one(csv: Path | None, jobs: int) -> None:
    """Refuse of one subject what is for several."""
    if csv is not None:
        raise typer.BadParameter("is a table of several subjects; this is one", param_hint="--csv")
    if jobs > 1:
        raise typer.BadParameter("is for several subjects; this is one", param_hint="--jobs")


def run_on_all(root: RootFolder, work: Work, jobs: int, json: Path | None, csv: Path | None) -> None:
    """Run a command on all subjects, print the table and the failures, and end with a status.

    Raises:
        Exit: some failed, or it was stopped.
        BadParameter: a file to write has no folder.
    """
    for option, file in (("--json", json), ("--csv", csv)):
        if file is not None and not file.absolute().parent.is_dir():
            raise typer.BadParameter(f"no folder {file.parent} to write into", param_hint=option)
    try:
        outcomes = done_to_all(root, work, jobs, typer.echo)
    except KeyboardInterrupt as stop:
        typer.echo("addb-viewer: stopped; what was finished is kept, and the same command goes on", err=True)
        raise typer.Exit(STOPPED) from stop
    print_table(outcomes)
    write_outcomes(outcomes, json, csv)
    failed = [outcome for outcome in outcomes if outcome.status is Status.FAILED]
    for outcome in failed:
        typer.echo(f"addb-viewer: {outcome.subject}: {outcome.reason}", err=True)
    if failed:
        typer.echo(f"addb-viewer: {len(failed)} of {len(outcomes)} subjects failed, see above", err=True)
        raise typer.Exit(FAILED)
