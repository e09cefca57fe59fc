"""What a person decides about a trial's frames, and for whom it counts: found, checked, put into the log."""

import getpass
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from addb_viewer.jobs.command_errors import check_folder, check_trials
from addb_viewer.jobs.review_store import has_log, open_log, record
from annotations.events import ClearRange, FlagRange
from annotations.foot_names import side_of
from annotations.review_errors import ReviewError
from annotations.trial_review import FlaggedRange, TrialReview
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.fitting.settings import settings_for


def subject_in(folder: Path) -> Subject:
    """The subject of a folder.

    Raises:
        CaptureError: no such folder, or nothing in it.
    """
    check_folder(folder)
    return open_subject(folder)


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


def login_name() -> str:
    """The author of an edit where nobody gives another name.

    Raises:
        ReviewError: this machine has no name for who is logged in.
    """
    try:
        return getpass.getuser()
    except (OSError, KeyError) as error:
        raise ReviewError("this machine does not say who is logged in; give a name") from error


def foot_meant(word: str, feet: Sequence[str]) -> str | None:
    """The foot body that a person means by right, left or its own name; None for both.

    Raises:
        ReviewError: no foot of that name, or not clear which.
    """
    if word == "both":
        return None
    if word in feet:
        return word
    found = [foot for foot in feet if word in ("right", "left") and side_of(foot) == word[0]]
    if len(found) != 1:
        raise ReviewError(f"'{word}' is not clear; give both or one of: {', '.join(feet)}")
    return found[0]


@dataclass(frozen=True)
class Noted:
    """An edit that is in the log, and the trial's review with it."""

    number: int
    review: TrialReview


def noted(
    subject: Subject, files: TrialFiles, capture: Capture, edit: FlagRange | ClearRange, author: str
) -> Noted:
    """Put a decision about a trial's frames into the subject's log.

    Args:
        subject: whose.
        files: of the trial.
        capture: the trial as read from them.
        edit: the decision.
        author: who makes it.

    Raises:
        ReviewError: it cannot be recorded.
    """
    with open_log(subject.folder) as log:
        number = record(log, files, capture, edit, author)
        return Noted(number, log.review(files.name, subject.foot_bodies))


def flagged(subject: Subject) -> list[tuple[str, FlaggedRange]]:
    """What is flagged in the subject's log, with its trial.

    Raises:
        ReviewError: the log cannot be read.
    """
    if not has_log(subject.folder):
        return []
    with open_log(subject.folder) as log:
        reviews = [log.review(trial.name, subject.foot_bodies) for trial in subject.trials]
    return [(review.trial, flag) for review in reviews for flag in review.flags]
