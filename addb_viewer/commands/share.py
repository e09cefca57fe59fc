"""`addb-viewer share`: bring a subject's own review file into the database that a lab shares."""

import typer

from addb_viewer import review_store
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import subject_in


def share(subject: SubjectFolder, debug: Debug = False) -> None:
    """Copy a subject's edits from its own file into the shared database, authors and dates included."""
    with errors_as_lines(debug):
        subject_in(subject)
        count = review_store.share(subject)
        typer.echo(f"{count} edits copied, as '{review_store.subject_key(subject)}'; the file stays as it is")
