"""`addb-viewer mark`: how far the review of a trial has come."""

from enum import StrEnum
from typing import Annotated

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import Author, TrialName, author_named, capture_of, subject_in, trial_of
from addb_viewer.review_store import open_log, record
from annotations.events import SetStatus, Status


class StatusWord(StrEnum):
    """A status as one word of a command line."""

    UNSEEN = "unseen"
    IN_WORK = "in-work"
    FINISHED = "finished"
    SECOND_LOOK = "second-look"


Note = Annotated[str, typer.Option("--note", metavar="TEXT", help="What others should know about it.")]
Wanted = Annotated[StatusWord, typer.Argument(metavar="STATUS", help=", ".join(StatusWord))]


def mark(
    subject: SubjectFolder,
    trial: TrialName,
    status: Wanted,
    note: Note = "",
    author: Author = None,
    debug: Debug = False,
) -> None:
    """Say how far the review of a trial has come; from in-work on, its flags decide which forces count."""
    with errors_as_lines(debug):
        opened, name = subject_in(subject), author_named(author)
        files = trial_of(opened, trial)
        capture = capture_of(opened, files)
        with open_log(subject) as log:
            number = record(log, files, capture, SetStatus(Status[status.name], note), name)
        typer.echo(f"{trial}: {Status[status.name]} (edit {number})")
