"""What the commands that read or edit the review log share."""

import re
from collections.abc import Sequence
from typing import Annotated

import typer

from addb_viewer.jobs.review_store import unreadable_notes
from addb_viewer.jobs.reviewing import foot_meant, login_name
from annotations.errors import ReviewError
from annotations.events import Edit
from annotations.log import ReviewLog
from annotations.unreadable import UnreadableRow
from annotations.wording import said_by
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
