"""`addb-viewer share`: bring a subject's own review file into the database that a lab shares."""

from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.jobs import review_store
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.reviewing import subject_in

WithoutUnreadable = Annotated[
    bool,
    typer.Option("--without-unreadable", help="Copy the others where a row of the file cannot be read."),
]


def share(
    subject: SubjectFolder, without_unreadable: WithoutUnreadable = False, debug: Debug = False
) -> None:
    """Copy a subject's edits from its own file into the shared database, authors and dates included."""
    with errors_as_lines(debug):
        subject_in(subject)
        done = review_store.share(subject, without_unreadable=without_unreadable)
        key = review_store.subject_key(subject)
        typer.echo(f"{done.copied} edits copied, as '{key}'; the file stays as it is")
        for note in review_store.unreadable_notes(done.left):
            typer.echo(f"note: not copied: {note}")
