"""`addb-viewer fit`: kinematics and dynamics of a subject; the results are kept and summed up."""

from dataclasses import replace
from typing import Annotated

import typer

from addb_viewer.commands.errors import FAILED, errors_as_lines
from addb_viewer.commands.options import (
    Debug,
    Force,
    IgnoreReview,
    JsonFile,
    MapFile,
    Out,
    SettingsFile,
    SubjectFolder,
    Trials,
    WithoutExtension,
)
from addb_viewer.commands.solving import job_for, solved
from addb_viewer.commands.summary_table import print_summary
from addb_viewer.commands.unused_files import print_unused
from solver.fit import Fit
from solver.results.store import write_json
from solver.summary import summary

Notes = Annotated[
    bool, typer.Option("--notes", help="List every file of the folder that is not used, and why.")
]


def fit(
    subject: SubjectFolder,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    map_: MapFile = None,
    ignore_review: IgnoreReview = False,
    without_extension: WithoutExtension = False,
    force: Force = False,
    json: JsonFile = None,
    notes: Notes = False,
    debug: Debug = False,
) -> None:
    """Fit the skeleton to a subject's recordings, keep the results and print the summary.

    Unchanged inputs are not solved again; where only flags changed, the fit begins at the kept one.
    """
    if json is not None and not json.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {json.parent} to write into", param_hint="--json")
    with errors_as_lines(debug):
        job = job_for(
            subject,
            out=out,
            trials=trial,
            settings_file=settings,
            map_file=map_,
            ignore_review=ignore_review,
            without_extension=without_extension,
        )
        done = solved(job, force=force)
        fit = replace(done.fit, subject=replace(done.fit.subject, unused=job.subject.unused))
        figures = summary(fit, files=[str(path) for path in done.files])
        if json is not None:
            write_json(json, figures)
        print_summary(figures if done.new else figures | {"files": []})
        print_unused(fit.unused, whole=notes)
        if done.said:
            typer.echo(done.said)
        if fit.unread:
            for unread in fit.unread:
                typer.echo(f"addb-viewer: {unread.file.file}: {unread.file.reason}", err=True)
            typer.echo(f"addb-viewer: fitted without {_counted(fit)}, see above", err=True)
            raise typer.Exit(FAILED)


def _counted(fit: Fit) -> str:
    """How many of the wanted trials could not be read."""
    trials = [trial.name for trial in fit.unread if trial.name]
    said = [f"{len(trials)} of {len(trials) + len(fit.trials)} trials"] if trials else []
    if len(trials) < len(fit.unread):
        said.append("the static trial")
    return " and ".join(said)
