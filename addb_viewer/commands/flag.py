"""`addb-viewer flag`: say on which frames a foot's force must not be used, and why."""

from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import (
    Author,
    TrialName,
    author_named,
    foot_named,
    frames_named,
)
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.review_store import unreadable_notes
from addb_viewer.jobs.reviewing import capture_of, noted, subject_in, trial_of
from annotations.errors import ReviewError
from annotations.events import ClearRange, FlagRange
from annotations.reasons import MANUAL_REVIEW, reason_named
from annotations.trial_review import TrialReview

Frames = Annotated[
    str, typer.Argument(metavar="FRAMES", help="START:END; END is the first frame after the range.")
]
Foot = Annotated[str, typer.Option("--foot", help="right, left, both, or the name of a foot's body.")]
Reason = Annotated[
    str | None,
    typer.Option(
        "--reason", metavar="WORD", help=f"Why the force does not count; {MANUAL_REVIEW} by default."
    ),
]
Note = Annotated[str, typer.Option("--note", metavar="TEXT", help="What others should know about it.")]
Clear = Annotated[bool, typer.Option("--clear", help="The force counts there, whatever was said before.")]


def flag(
    subject: SubjectFolder,
    trial: TrialName,
    frames: Frames,
    foot: Foot = "both",
    reason: Reason = None,
    note: Note = "",
    author: Author = None,
    clear: Clear = False,
    debug: Debug = False,
) -> None:
    """Flag frames of a trial whose force is missing or wrong; the next fit leaves it out."""
    chosen = _reason(reason, clear)
    with errors_as_lines(debug):
        opened, name = subject_in(subject), author_named(author)
        files = trial_of(opened, trial)
        of_foot = foot_named(foot, opened.foot_bodies)
        capture = capture_of(opened, files)
        start, end = frames_named(frames, trial, capture.markers.frames)
        event = (
            ClearRange(start, end, of_foot, note)
            if chosen is None
            else FlagRange(start, end, chosen, of_foot, note)
        )
        edit = noted(opened, files, capture, event, name)
        for line in unreadable_notes(edit.review.unreadable):
            typer.echo(f"note: {line}")
        said = "the force counts" if chosen is None else chosen
        typer.echo(
            f"{trial}: frames {start} to {end - 1}, {of_foot or 'both feet'}: {said} (edit {edit.number})"
        )
        _print_conflicts(edit.review, edit.number)


def _reason(word: str | None, clear: bool) -> str | None:
    """The reason's name; None where the range is to be cleared."""
    if clear and word is not None:
        raise typer.BadParameter("a cleared range has no reason", param_hint="--reason")
    if clear:
        return None
    try:
        return MANUAL_REVIEW if word is None else reason_named(word)
    except ReviewError as error:
        raise typer.BadParameter(str(error), param_hint="--reason") from error


def _print_conflicts(review: TrialReview, number: int) -> None:
    for conflict in review.conflicts_of(number):
        typer.echo(f"note: {review.trial}: {conflict}")
