"""`addb-viewer open`: the review app on one subject."""

from pathlib import Path

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import DEFAULT_HOST, DEFAULT_PORT, Debug, Host, Port, SubjectFolder
from addb_viewer.commands.solving import check_folder


def open_subject(
    subject: SubjectFolder, host: Host = DEFAULT_HOST, port: Port = DEFAULT_PORT, debug: Debug = False
) -> None:
    """Open the review app on a subject; without a fit it shows what was measured."""
    with errors_as_lines(debug):
        check_folder(subject)
        serve_app(subject, host, port)


def serve_app(subject: Path, host: str, port: int) -> None:
    """Serve the app until it is stopped; the address is printed."""
    from addb_viewer.app import serve  # noqa: PLC0415 (a second of imports that no other command needs)

    serve(subject, host, port)
