"""`addb-viewer fit`: kinematics and dynamics of a subject; the results are kept and summed up."""

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    JsonFile,
    Out,
    SettingsFile,
    SubjectFolder,
    Trials,
)
from addb_viewer.commands.solving import job_for, solved
from addb_viewer.commands.summary_table import print_summary
from solver.results.store import write_json
from solver.summary import summary


def fit(
    subject: SubjectFolder,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Fit the skeleton to a subject's recordings, keep the results and print the summary."""
    if json is not None and not json.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {json.parent} to write into", param_hint="--json")
    with errors_as_lines(debug):
        job = job_for(subject, out=out, trials=trial, settings_file=settings, ignore_review=ignore_review)
        fitted, files = solved(job)
        figures = summary(fitted, files=[str(path) for path in files])
        if json is not None:
            write_json(json, figures)
        print_summary(figures)
