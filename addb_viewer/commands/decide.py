"""`addb-viewer flag`, `mark`, `undo`, `redo`, `label`, `share`: what a person decides."""

import re
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.jobs import review_store
from addb_viewer.jobs.command_errors import errors_as_lines
from addb_viewer.jobs.force_reviews import undecided
from addb_viewer.jobs.review_store import has_log, open_log, record, take_in, unreadable_notes
from addb_viewer.jobs.reviewing import capture_of, foot_meant, login_name, noted, subject_in, trial_of
from annotations.events import ClearRange, Edit, FlagRange, Proposal, SetStatus, Status, Undo, Unusable
from annotations.log import ReviewLog
from annotations.ranges_csv import tables_from_csv
from annotations.reading import UnreadableRow
from annotations.reasons import MANUAL_REVIEW, reason_named, reason_words
from annotations.review_errors import ReviewError
from annotations.trial_review import TrialReview
from annotations.wording import said_by
from solver.capture.capture import Subject
from solver.common.file_names import readable

TrialName = Annotated[str, typer.Argument(metavar="TRIAL", parser=readable, help="Name of the trial.")]
Author = Annotated[
    str | None,
    typer.Option("--author", metavar="NAME", help="Who decides; your login name by default."),
]


def author_named(name: str | None) -> str:
    """The author of an edit: as given, else the login name.

    Raises:
        BadParameter: this machine has no name for who is logged in.
    """
    if name is not None:
        return name
    try:
        return login_name()
    except ReviewError as error:
        raise typer.BadParameter(str(error), param_hint="--author") from error


def foot_named(word: str, feet: Sequence[str]) -> str | None:
    """The foot body that a person means by right, left or its own name; None for both.

    Raises:
        BadParameter: no foot of that name, or not clear which.
    """
    try:
        return foot_meant(word, feet)
    except ReviewError as error:
        raise typer.BadParameter(str(error), param_hint="--foot") from error


def frames_named(text: str, trial: str, frames: int) -> tuple[int, int]:
    """A range as a person writes it: 120:180 holds frames 120 to 179; either number may be left out.

    Raises:
        BadParameter: not of that form.
        ReviewError: not within the trial.
    """
    match = re.fullmatch(r"(\d*):(\d*)", text.strip())
    if match is None:
        raise typer.BadParameter(f"'{text}' is no range; write START:END, as in 120:180", param_hint="FRAMES")
    start, end = int(match[1] or 0), int(match[2] or frames)
    if not start < end:
        raise typer.BadParameter(
            f"no frames in '{text}'; END is the first frame after the range", param_hint="FRAMES"
        )
    if end > frames:
        raise ReviewError(f"{trial}: {text} is not within the trial, which is 0:{frames}")
    return start, end


def tell_unreadable(log: ReviewLog, trial: str | None = None) -> None:
    """Print which rows of the log are passed over: those that may be about a trial, or all."""
    rows = log.unreadable()
    for note in unreadable_notes([row for row in rows if trial is None or row.may_be_about(trial)]):
        typer.echo(f"note: {note}")


def unreadable_figures(rows: Sequence[UnreadableRow]) -> list[dict[str, object]]:
    """Likewise for `--json`."""
    return [{"row": row.number, "author": row.author, "why": row.why} for row in rows]


def described(edit: Edit) -> str:
    """An edit in one line, with its date."""
    return f"edit {edit.number}, {edit.made_at:%Y-%m-%d %H:%M:%S} UTC, {edit.author}: {said_by(edit.event)}"


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


class StatusWord(StrEnum):
    """A status as one word of a command line."""

    UNSEEN = "unseen"
    IN_WORK = "in-work"
    FINISHED = "finished"
    SECOND_LOOK = "second-look"


StayOut = Annotated[
    bool,
    typer.Option("--undecided-stay-out", help="Finish, and leave out what detection left out, undecided."),
]
Unseen = Annotated[
    bool, typer.Option("--unseen", help="Finish a trial of which the log has no edit by anybody.")
]
UnusableFor = Annotated[
    Unusable | None,
    typer.Option("--unusable-for", help="Finish, and keep the trial out of releases; --note says why."),
]
Wanted = Annotated[StatusWord, typer.Argument(metavar="STATUS", help=", ".join(StatusWord))]


def mark(
    subject: SubjectFolder,
    trial: TrialName,
    status: Wanted,
    note: Note = "",
    unusable_for: UnusableFor = None,
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
            number = record(
                log, files, capture, SetStatus(Status[status.name], note, left_out, unusable_for), name
            )
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


Table = Annotated[
    Path, typer.Argument(metavar="FILE", help="CSV table, as `flags --csv` writes it.", dir_okay=False)
]


def label(subject: SubjectFolder, file: Table, author: Author = None, debug: Debug = False) -> None:
    """Take in a table of labels; they count wherever nobody has decided here."""
    with errors_as_lines(debug):
        opened, name = subject_in(subject), author_named(author)
        captures = {trial.name: capture_of(opened, trial) for trial in opened.trials}
        frames = {trial: capture.markers.frames for trial, capture in captures.items()}
        tables, ignored = tables_from_csv(_text(file), file.name, name, frames, opened.foot_bodies)
        with open_log(subject) as log:
            for trial, table in tables.items():
                number = take_in(log, trial_of(opened, trial), captures[trial], table)
                labels = len(table.ranges) + len(table.activities)
                status = f", {table.status}" if table.status else ""
                typer.echo(f"{trial}: {labels} ranges imported{status} (edit {number})")
            tell_unreadable(log)
        if ignored:
            typer.echo(f"note: not imported: the columns {', '.join(ignored)}")


def _text(file: Path) -> str:
    """The text of a table; a spreadsheet's byte-order mark is no part of it."""
    try:
        return file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ReviewError(f"{file}: is not UTF-8 text; save it as CSV UTF-8") from error


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
