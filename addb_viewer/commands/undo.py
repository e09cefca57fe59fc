"""`addb-viewer undo` and `redo`: take back an edit of the review, or the taking back."""

from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import Author, TrialName, author_named, described, tell_unreadable
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.review_store import has_log, open_log
from addb_viewer.jobs.reviewing import subject_in, trial_of
from annotations.errors import ReviewError
from annotations.events import Undo
from solver.capture.capture import Subject

Number = Annotated[
    int | None,
    typer.Option("--edit", metavar="NUMBER", help="This edit, not your last; `flags --history` lists them."),
]


def undo(
    subject: SubjectFolder,
    trial: TrialName,
    edit: Number = None,
    author: Author = None,
    debug: Debug = False,
) -> None:
    """Take back your last edit of a trial, or the one with that number."""
    with errors_as_lines(debug):
        opened, name = _reviewed(subject_in(subject), trial), author_named(author)
        with open_log(opened.folder) as log:
            if edit is None:
                undone = log.undo(trial, name)
            else:
                log.append(trial, Undo(edit), name)
                undone = next(one for one in log.history(trial) if one.number == edit)
            tell_unreadable(log, trial)
        typer.echo(f"{trial}: undone: {described(undone)}")


def redo(subject: SubjectFolder, trial: TrialName, author: Author = None, debug: Debug = False) -> None:
    """Let the edit that you undid last count again."""
    with errors_as_lines(debug):
        opened = _reviewed(subject_in(subject), trial)
        with open_log(opened.folder) as log:
            redone = log.redo(trial, author_named(author))
            tell_unreadable(log, trial)
        typer.echo(f"{trial}: counts again: {described(redone)}")


def _reviewed(subject: Subject, trial: str) -> Subject:
    """The subject, if there is a log with something to undo."""
    trial_of(subject, trial)
    if not has_log(subject.folder):
        raise ReviewError(f"{trial}: nobody has flagged anything yet")
    return subject
