"""`addb-viewer export`: the fit as files that other tools open."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.many import Row, Work, options, several
from addb_viewer.commands.many_subjects import CsvFile, Jobs, SubjectOrRoot, check_one, run_on_all
from addb_viewer.commands.options import Debug, IgnoreReview, JsonFile, Out, SettingsFile, Trials
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
    gltf = "gltf"


To = Annotated[
    Format,
    typer.Option(
        "--to",
        help="opensim: model, motion, torques, forces for OpenSim 4.6. "
        "b3d: the AddBiomechanics Dataset's format. csv, parquet: a table a trial. "
        "gltf: the moving skeleton, for Blender and browsers.",
    ),
]


def export(
    subject: SubjectOrRoot,
    to: To,
    out: Out = None,
    trial: Trials = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    jobs: Jobs = 1,
    csv: CsvFile = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Write the fit for other tools into the results folder; solve first where there is no current fit."""
    with errors_as_lines(debug):
        root = several(subject)
        if root is not None:
            words = options(
                to=to.value,
                trial=trial,
                settings=settings and settings.absolute(),
                ignore_review=ignore_review,
                debug=debug,
            )
            run_on_all(root, Work("export", words, out, _written, has_json=False), jobs, json, csv)
            return
        check_one(csv, jobs)
        if json is not None:
            raise typer.BadParameter("says what became of several subjects; this is one", param_hint="--json")
        job = job_for(subject, out=out, trials=trial, settings_file=settings, ignore_review=ignore_review)
        fit = current_fit(job)
        for path in _exported(fit, to, job.results):
            typer.echo(path)
        for note in renamed(fit) if to is not Format.b3d else ():
            typer.echo(f"note: {note}")


def _written(_: dict[str, Any], said: str) -> Row:
    """How many files a subject's export has written."""
    return {"files": sum(not line.startswith("note: ") for line in said.splitlines())}


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
        case Format.gltf:
            from solver.export.gltf import export_gltf  # noqa: PLC0415 (loads the meshes' library)

            return export_gltf(fit, results / "gltf")
