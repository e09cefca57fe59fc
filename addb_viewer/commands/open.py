"""`addb-viewer open` and `demo`: the review app on one subject, on several, or on a synthetic one."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.diagnose import print_diagnosis
from addb_viewer.commands.options import DEFAULT_HOST, DEFAULT_PORT, Debug, Host, Out, Port
from addb_viewer.jobs.command_errors import check_folder, errors_as_lines, warn
from addb_viewer.jobs.demo import make_demo
from addb_viewer.jobs.diagnosing import diagnosed
from addb_viewer.jobs.solving import job_for, kept_fit
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.summary_table import print_summary
from solver.capture.formats.b3d.places import subject_folder_of
from solver.fitting.summary import summary

Root = Annotated[
    Path,
    typer.Argument(metavar="ROOT", help="A subject's folder, a .b3d file, or a folder of several subjects."),
]


def open(
    root: Root,
    out: Out = None,
    host: Host = DEFAULT_HOST,
    port: Port = DEFAULT_PORT,
    debug: Debug = False,
) -> None:
    """Open the review app; subjects without a fit show what was measured.

    On another host than this machine's own, browsers need the token that is printed with the address.
    """
    with errors_as_lines(debug):
        root = subject_folder_of(root)
        check_folder(root)
        serve_app(root, host, port, out)


def serve_app(root: Path, host: str, port: int, results: Path | None = None) -> None:
    """Serve the app until it is stopped; the address is printed."""
    from addb_viewer.app.app import serve  # noqa: PLC0415 (a second of imports that no other command needs)

    serve(root, host, port, results)


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
        make_demo(folder)
        job = job_for(folder)
        with terminal_progress() as progress:
            done = kept_fit(job, progress=progress)
        warn(done.said)
        print_summary(summary(done.fit, files=[str(path) for path in done.files]))
        with terminal_progress() as progress:
            figures, kept = diagnosed(job, progress)
        print_diagnosis(figures, kept)
        if not no_serve:
            serve_app(folder, host, port)
