"""`addb-viewer open`: the review app on one subject."""

from pathlib import Path

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import DEFAULT_HOST, DEFAULT_PORT, Debug, Host, Out, Port, SubjectFolder
from addb_viewer.commands.solving import check_folder


def open_subject(
    subject: SubjectFolder,
    out: Out = None,
    host: Host = DEFAULT_HOST,
    port: Port = DEFAULT_PORT,
    debug: Debug = False,
) -> None:
    """Open the review app on a subject; without a fit it shows what was measured."""
    with errors_as_lines(debug):
        check_folder(subject)
        serve_app(subject, host, port, out)


def serve_app(subject: Path, host: str, port: int, results: Path | None = None) -> None:
    """Serve the app until it is stopped; the address is printed."""
    from addb_viewer.app.app import serve  # noqa: PLC0415 (a second of imports that no other command needs)

    serve(subject, host, port, results)
