"""`addb-viewer demo`: a synthetic subject with two faults, fitted, diagnosed and opened in the app."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from addb_viewer.commands.diagnose import print_diagnosis
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.open import serve_app
from addb_viewer.commands.options import DEFAULT_HOST, DEFAULT_PORT, Debug, Host, Port
from addb_viewer.commands.progress import terminal_progress
from addb_viewer.commands.summary_table import print_summary
from addb_viewer.jobs.diagnosing import diagnosed
from addb_viewer.jobs.solving import job_for, solved
from solver.capture.atomic import made_folder
from solver.errors import CaptureError
from solver.simulate.demo import LateForces, write_demo_subject
from solver.summary import summary

SEED = 20_240_901  # any number: the same demo for everyone
_OURS = ".addb-viewer-demo"  # marks a folder that the demo may write over

Folder = Annotated[
    Path, typer.Option("--folder", metavar="DIR", help="Folder for the demo subject.", file_okay=False)
]
NoServe = Annotated[bool, typer.Option("--no-serve", help="Stop after the diagnosis; don't open the app.")]


def demo(
    folder: Folder = Path("demo"),
    no_serve: NoServe = False,
    host: Host = DEFAULT_HOST,
    port: Port = DEFAULT_PORT,
    debug: Debug = False,
) -> None:
    """Make the demo subject, fit it, say what is wrong with it, and open the app on it.

    One step finds no plate, and all forces come late; nothing in the files says so.
    """
    with errors_as_lines(debug):
        _make_subject(folder)
        job = job_for(folder)
        with terminal_progress() as progress:
            done = solved(job, progress=progress)
        print_summary(summary(done.fit, files=[str(path) for path in done.files]))
        with terminal_progress() as progress:
            figures, kept = diagnosed(job, progress)
        print_diagnosis(figures, kept)
        if not no_serve:
            serve_app(folder, host, port)


def _make_subject(folder: Path) -> None:
    mark = folder / _OURS
    if folder.is_dir() and any(folder.iterdir()) and not mark.is_file():
        raise CaptureError(f"{folder}: not empty and not the demo's; choose another folder with --folder")
    made_folder(folder)
    mark.touch()
    write_demo_subject(folder, np.random.default_rng(SEED), cause=LateForces())
