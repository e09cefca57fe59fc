"""A subject's review log as this program uses it: where it lies, how an edit enters it, what a solve gets."""

import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from annotations.database import Database, is_url
from annotations.errors import ReviewError
from annotations.events import IMPORTED, Edit, Event, ImportTable, Proposal
from annotations.log import ReviewLog
from annotations.review_json import FINISHED, import_labels
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.contact.proposals import Proposal as Found
from solver.contact.wrenches import MissingRange

PROGRAM = "addb-viewer"
FILE = "annotations.sqlite"
STORE = "ADDB_VIEWER_STORE"  # environment: URL of a database that several people share
ROOT = "ADDB_VIEWER_ROOT"  # environment: the folder that all of its subjects lie below


def store_url() -> str | None:
    """The URL of the shared database; None where every subject keeps its own file.

    Raises:
        ReviewError: the environment names something else.
    """
    url = os.environ.get(STORE) or None
    if url is not None and not is_url(url):
        raise ReviewError(
            f"{STORE} is no URL of a database; write postgresql://USER@HOST:PORT/DATABASE, or leave it out "
            f"to keep reviews in SUBJECT/{FILE}"
        )
    return url


def has_log(subject_folder: Path) -> bool:
    """Whether there is a log to read; that of a shared database may have no edits of this subject."""
    return store_url() is not None or (subject_folder / FILE).is_file()


def open_log(subject_folder: Path) -> ReviewLog:
    """The subject's review log, made where it is missing; close it, or use it in a `with`.

    Raises:
        ReviewError: it cannot be opened, or a newer version made it.
    """
    url = store_url()
    if url is None:
        return ReviewLog.open(subject_folder / FILE)
    return ReviewLog(_shared(url, os.getpid()), subject_key(subject_folder))


def all_edits(subject_folder: Path) -> tuple[Edit, ...]:
    """Everything that people decided about a subject, in order; nothing is made where there is no log.

    Raises:
        ReviewError: it cannot be read.
    """
    if not has_log(subject_folder):
        return ()
    with open_log(subject_folder) as log:
        return log.history()


def subject_key(subject_folder: Path) -> str:
    """What a subject is called in a shared database, on whichever machine and below whichever mount point.

    It is the folder's path below ADDB_VIEWER_ROOT, if that is set and the folder lies there; else its name.
    """
    folder, root = subject_folder.resolve(), os.environ.get(ROOT)
    if root and folder.is_relative_to(Path(root).resolve()):
        return folder.relative_to(Path(root).resolve()).as_posix()
    return folder.name


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


def take_in(log: ReviewLog, files: TrialFiles, capture: Capture, table: ImportTable) -> int:
    """Record the labels of a table, in place of those of the trial's review.json and of tables before.

    Returns:
        The edit's number.

    Raises:
        ReviewError: it cannot be recorded.
    """
    return record(log, files, capture, table, IMPORTED)


def share(subject_folder: Path) -> int:
    """Copy the edits of a subject's own file into the shared database.

    Returns:
        How many.

    Raises:
        ReviewError: there is no shared database or no file, or the database has edits of the subject already.
    """
    if store_url() is None:
        raise ReviewError(f"no shared database is named; give its URL by --store or in {STORE}")
    if not (subject_folder / FILE).is_file():
        raise ReviewError(f"{subject_folder}: has no {FILE} to copy")
    with ReviewLog.open(subject_folder / FILE) as own, open_log(subject_folder) as shared:
        return shared.take_over(own.history())


def as_proposal(found: Found, provenance: Mapping[str, str]) -> Proposal:
    """A finding of ours as the log keeps it, with the version that found it.

    Args:
        found: by the detection.
        provenance: of the fit that it looked at.
    """
    start, end = found.range
    detector = f"{PROGRAM} {provenance.get(PROGRAM, '')}".strip()
    return Proposal(start, end, found.reason, found.foot, found.confidence, dict(found.evidence), detector)


def reviews_for_solve(
    subject: Subject, trials: Sequence[TrialFiles]
) -> tuple[dict[str, tuple[MissingRange, ...]], tuple[str, ...]]:
    """What people decided about trials, as the solver takes it, and what they should know about it.

    Args:
        subject: whose.
        trials: those to be solved.

    Returns:
        Ranges of missing force by trial, only of trials on which a person has decided something; and notes:
        where reviewers disagree, and edits that are not used.

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
        notes.append(f"{_place()}: has edits of trials that the subject does not have: {', '.join(gone)}")
    if store_url() is not None and (subject.folder / FILE).is_file():
        notes.append(
            f"{FILE}: not used, because reviews are kept in a shared database; `share` copies it there"
        )
    return {review.trial: review.missing_ranges for review in reviews if review.decided}, tuple(notes)


def _place() -> str:
    return FILE if store_url() is None else "the shared database"


@cache
def _shared(url: str, _process: int) -> Database:
    """One pool of connections for all subjects; a forked process makes its own."""
    return Database(url)
