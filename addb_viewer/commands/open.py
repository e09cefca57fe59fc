"""`addb-viewer open`: the review app on one subject, or on a folder of several."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import DEFAULT_HOST, DEFAULT_PORT, Debug, Host, Out, Port
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.subject_checks import check_folder
from solver.capture.formats.b3d.places import subject_folder_of

Root = Annotated[
    Path,
    typer.Argument(metavar="ROOT", help="A subject's folder, a .b3d file, or a folder of several subjects."),
]


def open_subject(
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
