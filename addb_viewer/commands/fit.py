"""`addb-viewer fit`: kinematics and dynamics of a subject; the results are kept and summed up."""

from dataclasses import replace
from typing import Annotated, Any

import typer

from addb_viewer.commands.errors import FAILED, STOPPED, errors_as_lines
from addb_viewer.commands.options import (
    Debug,
    Force,
    IgnoreReview,
    JsonFile,
    MapFile,
    Out,
    Quick,
    SettingsFile,
    SubjectFolder,
    Trials,
    WithoutExtension,
)
from addb_viewer.commands.progress import terminal_progress
from addb_viewer.commands.solving import Job, Solved, job_for, solved
from addb_viewer.commands.summary_table import print_summary, print_withheld
from addb_viewer.commands.unused_files import unused_lines
from addb_viewer.commands.withholding import FitReplacedError, Withholding
from addb_viewer.withheld_words import rest_words
from solver.fit import Fit
from solver.results.store import write_json
from solver.summary import summary

Notes = Annotated[
    bool,
    typer.Option("--notes", help="Print all that was noted, and every file that is not used, and why."),
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
    quick: Quick = False,
    json: JsonFile = None,
    notes: Notes = False,
    debug: Debug = False,
) -> None:
    """Fit the skeleton to a subject's recordings, keep the results and print the summary.

    Unchanged inputs are not solved again; where only flags changed, the fit begins at the kept one. Once the
    summary is printed and the fit kept, all other layouts of withheld forces follow: Ctrl-C keeps the fit and
    those that came.
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
        print_summary(
            figures if done.new else figures | {"files": []},
            notes=notes,
            closing=[*unused_lines(fit.unused, whole=notes), *filter(None, [done.said])],
        )
        if not quick:
            withheld = _judged_on_all_layouts(job, done, notes)
            if json is not None:
                write_json(json, figures | {"trials": summary(withheld)["trials"]})
        if fit.unread:
            for unread in fit.unread:
                typer.echo(f"addb-viewer: {unread.file.file}: {unread.file.reason}", err=True)
            typer.echo(f"addb-viewer: fitted without {_counted(fit)}, see above", err=True)
            raise typer.Exit(FAILED)


def _judged_on_all_layouts(job: Job, done: Solved, notes: bool) -> Fit:
    """The fit with all layouts of withheld forces, which are printed when they are there."""
    withholding = Withholding(done.fit, job.results, done.files[1].parent.name)
    if not withholding.is_due:
        return done.fit
    try:
        with terminal_progress() as progress:
            withholding.run(job.settings, progress, job.extension)
    except FitReplacedError:
        typer.echo("withheld forces: not judged any further; another fit has taken the place of this one")
    except KeyboardInterrupt as stop:
        figures: dict[str, Any] = summary(withholding.fit)
        print_withheld(figures, notes=notes)
        rest = rest_words(figures["trials"])
        typer.echo(f"addb-viewer: stopped; the fit is kept. {rest or ''}".rstrip(), err=True)
        raise typer.Exit(STOPPED) from stop
    print_withheld(summary(withholding.fit), notes=notes)
    return withholding.fit


def _counted(fit: Fit) -> str:
    """How many of the wanted trials could not be read."""
    trials = [trial.name for trial in fit.unread if trial.name]
    said = [f"{len(trials)} of {len(trials) + len(fit.trials)} trials"] if trials else []
    if len(trials) < len(fit.unread):
        said.append("the static trial")
    return " and ".join(said)
