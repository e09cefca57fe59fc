"""`addb-viewer export`: the fit as files that other tools open."""

from enum import StrEnum
from typing import Annotated

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, IgnoreReview, Out, SettingsFile, SubjectFolder, Trials
from addb_viewer.commands.solving import current_fit, job_for
from solver.export.opensim import export_opensim


class Format(StrEnum):
    """What `--to` takes."""

    opensim = "opensim"


To = Annotated[Format, typer.Option("--to", help="opensim: model, motion, torques, forces for OpenSim 4.6.")]


def export(
    subject: SubjectFolder,
    to: To,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    debug: Debug = False,
) -> None:
    """Write the fit for other tools into RESULTS/opensim; solve first where there is no current fit."""
    with errors_as_lines(debug):
        job = job_for(subject, out=out, trials=trial, settings_file=settings, ignore_review=ignore_review)
        fit = current_fit(job)
        for path in export_opensim(fit, job.results / to.value):
            typer.echo(path)
