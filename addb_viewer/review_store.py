"""A subject's review log as this program uses it: where it lies, how an edit enters it, what a solve gets."""

from collections.abc import Sequence
from pathlib import Path

from annotations.events import Event
from annotations.log import ReviewLog
from annotations.review_json import FINISHED, import_labels
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.contact.wrenches import MissingRange

FILE = "annotations.sqlite"


def has_log(subject_folder: Path) -> bool:
    """Whether anybody has recorded an edit of this subject."""
    return (subject_folder / FILE).is_file()


def open_log(subject_folder: Path) -> ReviewLog:
    """The subject's review log, made where it is missing; close it, or use it in a `with`.

    Raises:
        ReviewError: it cannot be opened, or a newer version made it.
    """
    return ReviewLog.open(subject_folder / FILE)


def record(log: ReviewLog, files: TrialFiles, capture: Capture, event: Event, author: str) -> int:
    """Record a person's edit of a trial, on top of what its review.json says.

    As soon as a person has decided anything, the log alone says which forces count; so the labels of the
    trial's review.json are taken into it first.

    Args:
        log: the subject's.
        files: of the trial.
        capture: the trial as read from them.
        event: the edit.
        author: who makes it.

    Returns:
        The edit's number.

    Raises:
        ReviewError: it cannot be recorded.
    """
    if capture.imported_missing_force is not None:
        finished = all((review.parent / FINISHED).exists() for review in files.reviews)
        import_labels(log, files.name, capture.imported_missing_force, finished)
    return log.append(files.name, event, author)


def reviews_for_solve(
    subject: Subject, trials: Sequence[TrialFiles]
) -> tuple[dict[str, tuple[MissingRange, ...]], tuple[str, ...]]:
    """What people decided about trials, as the solver takes it, and what they should know about it.

    Args:
        subject: whose.
        trials: those to be solved.

    Returns:
        Ranges of missing force by trial, only of trials on which a person has decided something; and notes:
        where reviewers disagree, and edits of trials that the subject does not have any more.

    Raises:
        ReviewError: the log cannot be read, or is about a foot that the subject does not have.
    """
    if not has_log(subject.folder):
        return {}, ()
    with open_log(subject.folder) as log:
        reviews = [log.review(trial.name, subject.foot_bodies) for trial in trials]
        gone = sorted(set(log.trials()) - {trial.name for trial in subject.trials})
    notes = [f"{review.trial}: {conflict}" for review in reviews for conflict in review.conflicts]
    if gone:
        notes.append(f"{FILE}: has edits of trials that the subject does not have: {', '.join(gone)}")
    return {review.trial: review.missing_ranges for review in reviews if review.decided}, tuple(notes)
