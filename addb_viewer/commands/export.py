"""`addb-viewer export`, `convert` and `record`: a fit, or what a file holds, for other tools."""

import tempfile
from contextlib import ExitStack
from pathlib import Path
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
from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    JsonFile,
    Out,
    SettingsFile,
    Solve,
    SubjectFolder,
    Trials,
    file_to_read,
    file_to_write,
    replaceable,
)
from addb_viewer.jobs.command_errors import errors_as_lines, warn
from addb_viewer.jobs.exporting import Format, exported
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import unreadable_notes, whole_log
from addb_viewer.jobs.solving import Job, job_for, kept_fit
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.trial_view.recorded_subject import Recording, recording_of
from solver.fitting.fit_result import Fit

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


MusclesFrom = Annotated[
    Path | None,
    file_to_read(
        "--muscles-from",
        "OpenSim model whose muscles the default body gets in --to opensim, such as Rajagopal 2016.",
        metavar="MODEL",
    ),
]


def export(
    subject: SubjectOrRoot,
    to: To,
    out: Out = None,
    trial: Trials = None,
    muscles_from: MusclesFrom = None,
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
                muscles_from=muscles_from and muscles_from.absolute(),
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
            files, notes = exported(done.fit, form, job.results, muscles_from)
            for path in files:
                typer.echo(path)
            for note in notes:
                typer.echo(f"note: {note}")


def _written(_: dict[str, Any], said: str) -> Row:
    """How many files a subject's export has written."""
    return {"files": sum(not line.startswith("note: ") for line in said.splitlines())}


Source = Annotated[
    Path,
    typer.Argument(
        metavar="IN",
        help="A .c3d, .trc, .mot, .b3d or .parquet file, or a folder with a model and its motions.",
    ),
]
Target = Annotated[
    Path,
    typer.Argument(
        metavar="OUT",
        help="A file in .c3d, .trc, .mot, .b3d, .parquet, .glb or .xml (MuJoCo), or a folder (OpenSim).",
    ),
]
Forces = Annotated[Path | None, file_to_read("--forces", "Table of ground forces that belongs to IN.")]
Model = Annotated[
    Path | None, file_to_read("--model", "OpenSim model whose coordinates IN, a .mot file, holds.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that are there.")]


def convert(
    source: Source,
    target: Target,
    forces: Forces = None,
    model: Model = None,
    trial: Trials = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Write what a file holds in another format, without a fit; says what the other cannot hold."""
    from solver.export.conversion.convert import convert as converted  # noqa: PLC0415 (loads all formats' libraries)

    with errors_as_lines(debug):
        done = converted(source, target, forces=forces, model=model, trials=trial or (), overwrite=overwrite)
        for path in done.files:
            typer.echo(path)
        for note in done.notes:
            typer.echo(f"note: {note}")


Rrd = Annotated[Path | None, file_to_write("--rrd", "Write a recording for rerun's viewer.", replaceable)]
Mcap = Annotated[
    Path | None, file_to_write("--mcap", "Write an MCAP file, for Foxglove among others.", replaceable)
]
Serve = Annotated[
    bool,
    typer.Option("--serve", help="Show it in rerun's viewer, for this machine only; Ctrl-C ends it."),
]
Port = Annotated[
    int,
    typer.Option("--port", help="Port of --serve; 0 lets the system choose.", min=0, max=65535),
]


def record(
    subject: SubjectFolder,
    rrd: Rrd = None,
    mcap: Mcap = None,
    trial: Trials = None,
    serve: Serve = False,
    port: Port = 0,
    solve: Solve = False,
    out: Out = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    debug: Debug = False,
) -> None:
    """Record the fit for rerun or Foxglove; solve first where none is kept."""
    if rrd is None and mcap is None and not serve:
        raise typer.BadParameter("say where to: --rrd FILE, --mcap FILE, or --serve", param_hint="--rrd")
    with errors_as_lines(debug), ExitStack() as stack:
        job = job_for(subject, out=out, settings_file=settings, ignore_review=ignore_review)
        with terminal_progress() as progress:
            done = kept_fit(job, trial or (), anew=solve, progress=progress)
        warn(done.said)
        recording = _recording(done.fit, job)
        if mcap is not None:
            from addb_viewer.recordings.mcap_recording import write_mcap  # noqa: PLC0415 (slow to load)

            typer.echo(write_mcap(recording, mcap))
        if rrd is None and serve:
            rrd = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "recording.rrd"
        if rrd is not None:
            from addb_viewer.recordings.rrd_recording import write_rrd  # noqa: PLC0415 (slow to load)

            typer.echo(write_rrd(recording, rrd))
            if serve:
                _serve(rrd, port)


def _recording(fit: Fit, job: Job) -> Recording:
    diagnosis, said = kept(job.results), whole_log(job.subject.folder)
    for note in unreadable_notes(said.unreadable):
        typer.echo(f"note: not recorded: {note}")
    return recording_of(fit, diagnosis=diagnosis[0] if diagnosis else None, edits=said.edits)


def _serve(file: Path, port: int) -> None:
    from addb_viewer.recordings.rrd_server import RrdServer, viewer_files  # noqa: PLC0415 (slow to load)

    server = RrdServer(file, viewer_files(), port)
    typer.echo(f"{server.url}\nCtrl-C ends it")
    try:
        server.serve()
    except KeyboardInterrupt:
        typer.echo("ended")
