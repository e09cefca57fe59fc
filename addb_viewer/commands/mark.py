"""`addb-viewer mark`: how far the review of a trial has come."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import Author, TrialName, author_named, tell_unreadable
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.force_reviews import undecided
from addb_viewer.jobs.review_store import open_log, record
from addb_viewer.jobs.reviewing import capture_of, subject_in, trial_of
from annotations.errors import ReviewError
from annotations.events import Proposal, SetStatus, Status
from annotations.reasons import reason_words


class StatusWord(StrEnum):
    """A status as one word of a command line."""

    UNSEEN = "unseen"
    IN_WORK = "in-work"
    FINISHED = "finished"
    SECOND_LOOK = "second-look"


Note = Annotated[str, typer.Option("--note", metavar="TEXT", help="What others should know about it.")]
StayOut = Annotated[
    bool,
    typer.Option("--undecided-stay-out", help="Finish, and leave out what detection left out, undecided."),
]
Unseen = Annotated[
    bool, typer.Option("--unseen", help="Finish a trial of which the log has no edit by anybody.")
]
Wanted = Annotated[StatusWord, typer.Argument(metavar="STATUS", help=", ".join(StatusWord))]


def mark(
    subject: SubjectFolder,
    trial: TrialName,
    status: Wanted,
    note: Note = "",
    undecided_stay_out: StayOut = False,
    unseen: Unseen = False,
    author: Author = None,
    debug: Debug = False,
) -> None:
    """Say how far the review of a trial has come; once it is finished, detection changes nothing in it."""
    with errors_as_lines(debug):
        opened, name = subject_in(subject), author_named(author)
        files = trial_of(opened, trial)
        capture = capture_of(opened, files)
        with open_log(subject) as log:
            left_out = None
            if status is StatusWord.FINISHED:
                if not (unseen or log.history(trial) or files.has_review):
                    raise ReviewError(
                        f"{trial}: nobody has looked at it, as far as the log tells. Look at it with "
                        "`addb-viewer open`, or finish it with --unseen"
                    )
                left_out = undecided(opened, files, capture, log.history(trial))
                if left_out and not undecided_stay_out:
                    raise ReviewError(_asked(trial, left_out))
            number = record(log, files, capture, SetStatus(Status[status.name], note, left_out), name)
            tell_unreadable(log, trial)
        typer.echo(f"{trial}: {Status[status.name]} (edit {number})")
        if status is StatusWord.FINISHED and left_out is None:
            typer.echo(f"note: {trial}: not fitted yet; what detection will leave out stays left out")
        for proposal in left_out or ():
            typer.echo(f"note: {trial}: {_words(proposal)} was not decided by anybody and stays left out")


def _asked(trial: str, left_out: Sequence[Proposal]) -> str:
    what = "; ".join(map(_words, left_out))
    return (
        f"{trial}: detection leaves out what nobody has decided: {what}. Decide it with `flag`, or in the "
        "app; or finish with --undecided-stay-out"
    )


def _words(proposal: Proposal) -> str:
    foot = proposal.foot or "both feet"
    return f"frames {proposal.start} to {proposal.end - 1}, {foot}, {reason_words(proposal.reason)}"
