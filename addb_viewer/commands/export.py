"""`addb-viewer export`: the fit as files that other tools open."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, IgnoreReview, Out, SettingsFile, SubjectFolder, Trials
from addb_viewer.commands.solving import current_fit, job_for
from solver.export.b3d.from_fit import export_b3d
from solver.export.opensim import export_opensim
from solver.export.places import renamed
from solver.export.tables import export_csv, export_parquet
from solver.fit import Fit


class Format(StrEnum):
    """What `--to` takes."""

    opensim = "opensim"
    b3d = "b3d"
    csv = "csv"
    parquet = "parquet"


To = Annotated[
    Format,
    typer.Option(
        "--to",
        help="opensim: model, motion, torques, forces for OpenSim 4.6. "
        "b3d: the AddBiomechanics Dataset's format. csv, parquet: a table a trial.",
    ),
]


def export(
    subject: SubjectFolder,
    to: To,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    debug: Debug = False,
) -> None:
    """Write the fit for other tools into the results folder; solve first where there is no current fit."""
    with errors_as_lines(debug):
        job = job_for(subject, out=out, trials=trial, settings_file=settings, ignore_review=ignore_review)
        fit = current_fit(job)
        for path in _exported(fit, to, job.results):
            typer.echo(path)
        for note in renamed(fit) if to is not Format.b3d else ():
            typer.echo(f"note: {note}")


def _exported(fit: Fit, to: Format, results: Path) -> list[Path]:
    match to:
        case Format.opensim:
            return export_opensim(fit, results / "opensim")
        case Format.b3d:
            return export_b3d(fit, results)
        case Format.csv:
            return export_csv(fit, results / "csv")
        case Format.parquet:
            return export_parquet(fit, results / "parquet")
