"""`addb-viewer export`: the fit as files that other tools open."""

from typing import Annotated, Any

import typer

from addb_viewer.commands.many import (
    CsvFile,
    Jobs,
    Row,
    SubjectOrRoot,
    Work,
    check_one,
    options,
    run_on_all,
    several,
)
from addb_viewer.commands.options import Debug, IgnoreReview, JsonFile, Out, SettingsFile, Solve, Trials
from addb_viewer.jobs.errors import errors_as_lines, warn
from addb_viewer.jobs.exporting import Format, exported
from addb_viewer.jobs.solving import job_for, kept_fit
from addb_viewer.jobs.terminal_progress import terminal_progress

To = Annotated[
    list[Format],
    typer.Option(
        "--to",
        help="opensim: model, motion, torques, forces for OpenSim 4.6. "
        "b3d: the AddBiomechanics Dataset's format. csv, parquet: a table a trial. "
        "gltf: the moving skeleton, for Blender and browsers. mujoco: model and motion for MuJoCo. "
        "c3d: recorded markers and plates with events, joint angles and moments. May be given several times.",
    ),
]


def export(
    subject: SubjectOrRoot,
    to: To,
    out: Out = None,
    trial: Trials = None,
    solve: Solve = False,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    jobs: Jobs = 1,
    csv: CsvFile = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Write the fit for other tools into the results folder; solve first where none is kept."""
    with errors_as_lines(debug):
        root = several(subject)
        if root is not None:
            words = options(
                to=[form.value for form in dict.fromkeys(to)],
                trial=trial,
                solve=solve,
                settings=settings and settings.absolute(),
                ignore_review=ignore_review,
                debug=debug,
            )
            run_on_all(root, Work("export", words, out, _written, has_json=False), jobs, json, csv)
            return
        check_one(csv, jobs)
        if json is not None:
            raise typer.BadParameter("says what became of several subjects; this is one", param_hint="--json")
        job = job_for(subject, out=out, settings_file=settings, ignore_review=ignore_review)
        with terminal_progress() as progress:
            done = kept_fit(job, trial or (), anew=solve, progress=progress)
        warn(done.said)
        for form in dict.fromkeys(to):
            files, notes = exported(done.fit, form, job.results)
            for path in files:
                typer.echo(path)
            for note in notes:
                typer.echo(f"note: {note}")


def _written(_: dict[str, Any], said: str) -> Row:
    """How many files a subject's export has written."""
    return {"files": sum(not line.startswith("note: ") for line in said.splitlines())}
