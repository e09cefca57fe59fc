"""What the commands that read or edit the review log share."""

import getpass
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.subject_checks import check_folder, check_trials
from addb_viewer.review_store import unreadable_notes
from annotations.errors import ReviewError
from annotations.events import Edit
from annotations.log import ReviewLog
from annotations.unreadable import UnreadableRow
from annotations.wording import said_by
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.subject import open_subject
from solver.capture.trial import read_trial
from solver.settings import settings_for

TrialName = Annotated[str, typer.Argument(metavar="TRIAL", help="Name of the trial.")]
Author = Annotated[
    str | None,
    typer.Option("--author", metavar="NAME", help="Who decides; your login name by default."),
]

_SIDES = {"right": {"r", "right"}, "left": {"l", "left"}}
_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+")  # of a body's name: calcn_r, footR, RightFoot


def subject_in(folder: Path) -> Subject:
    """The subject of a folder.

    Raises:
        CaptureError: no such folder, or nothing in it.
    """
    check_folder(folder)
    return open_subject(folder, settings_for(folder).reading)


def trial_of(subject: Subject, name: str) -> TrialFiles:
    """The subject's trial of that name.

    Raises:
        CaptureError: there is none; the nearest names, or all of them, are listed.
    """
    check_trials(subject, [name])
    return next(trial for trial in subject.trials if trial.name == name)


def capture_of(subject: Subject, files: TrialFiles) -> Capture:
    """One trial as a solve of the subject would read it.

    Raises:
        CaptureError: its files cannot be read.
        SettingsError: the subject's settings.toml cannot be used.
    """
    return read_trial(files, settings_for(subject.folder).reading, subject.mass_kg)


def author_named(name: str | None) -> str:
    """The author of an edit: as given, else the login name.

    Raises:
        BadParameter: this machine has no name for who is logged in.
    """
    if name is not None:
        return name
    try:
        return getpass.getuser()
    except (OSError, KeyError) as error:
        raise typer.BadParameter(
            "this machine does not say who is logged in; give a name", param_hint="--author"
        ) from error


def foot_named(word: str, feet: Sequence[str]) -> str | None:
    """The foot body that a person means by right, left or its own name; None for both.

    Raises:
        BadParameter: no foot of that name, or not clear which.
    """
    if word == "both":
        return None
    if word in feet:
        return word
    sides = _SIDES.get(word, set())
    found = [foot for foot in feet if sides & {part.lower() for part in _WORDS.findall(foot)}]
    if len(found) != 1:
        raise typer.BadParameter(
            f"'{word}' is not clear; give both or one of: {', '.join(feet)}", param_hint="--foot"
        )
    return found[0]


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
