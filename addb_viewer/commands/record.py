"""`addb-viewer record`: a fit as timelines for rerun and Foxglove, without the app."""

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    Out,
    SettingsFile,
    Solve,
    SubjectFolder,
    replaceable,
)
from addb_viewer.jobs.errors import errors_as_lines, warn
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import unreadable_notes, whole_log
from addb_viewer.jobs.solving import Job, job_for, kept_fit
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.trial_view.recording import Recording, recording_of
from solver.common.file_names import readable
from solver.fitting.fit import Fit

Rrd = Annotated[
    Path | None,
    typer.Option(
        "--rrd",
        metavar="FILE",
        help="Write a recording for rerun's viewer.",
        dir_okay=False,
        callback=replaceable,
    ),
]
Mcap = Annotated[
    Path | None,
    typer.Option(
        "--mcap",
        metavar="FILE",
        help="Write an MCAP file, for Foxglove among others.",
        dir_okay=False,
        callback=replaceable,
    ),
]
TrialNames = Annotated[
    list[str] | None,
    typer.Option(
        "--trial", metavar="NAME", parser=readable, help="Record this trial only; may be given several times."
    ),
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
    trial: TrialNames = None,
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
