"""A subject's review log as this program uses it: where it lies, and how an edit enters it."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from addb_viewer.jobs.environment import ROOT, STORE
from annotations.events import IMPORTED, ClearRange, Edit, Event, FlagRange, ImportTable, Proposal, Status
from annotations.label_runs import true_runs
from annotations.reading import Reading, UnreadableRow, listed
from annotations.review_errors import ReviewError
from annotations.review_json import FINISHED, import_labels, labels_of
from solver.capture.atomic import made_folder
from solver.capture.capture import Capture, TrialFiles
from solver.capture.formats.b3d.places import recording_of
from solver.contact.detected_ranges import Proposal as Found

if TYPE_CHECKING:  # databases take long to load, and most subjects have none
    from annotations.database import Database
    from annotations.log import ReviewLog
    from annotations.work import WorkItem

PROGRAM = "addb-viewer"
FILE = "annotations.sqlite"


def store_url() -> str | None:
    """The URL of the shared database; None where every subject keeps its own file.

    Raises:
        ReviewError: the environment names something else.
    """
    url = os.environ.get(STORE) or None
    if url is None:
        return None
    from annotations.database import is_url  # noqa: PLC0415 (slow to load; most have no database)

    if not is_url(url):
        raise ReviewError(
            f"{STORE} is no URL of a database; write postgresql://USER@HOST:PORT/DATABASE, or leave it out "
            f"to keep reviews in SUBJECT/{FILE}"
        )
    return url


def has_log(subject_folder: Path) -> bool:
    """Whether there is a log to read; that of a shared database may have no edits of this subject."""
    return store_url() is not None or (subject_folder / FILE).is_file()


def open_log(subject_folder: Path) -> "ReviewLog":
    """The subject's review log, made where it is missing; close it, or use it in a `with`.

    Raises:
        ReviewError: it cannot be opened, or a newer version made it.
    """
    from annotations.log import ReviewLog  # noqa: PLC0415 (likewise)

    url = store_url()
    if url is None:
        if recording_of(subject_folder) is not None:
            made_folder(subject_folder)
        return ReviewLog.open(subject_folder / FILE)
    return ReviewLog(_shared(url, os.getpid()), subject_key(subject_folder))


def whole_log(subject_folder: Path) -> Reading:
    """Everything that people decided about a subject, in order; nothing is made where there is no log.

    Raises:
        ReviewError: it cannot be read.
    """
    return whole_logs(subject_folder)[0]


def whole_logs(subject_folder: Path) -> "tuple[Reading, tuple[WorkItem, ...]]":
    """Everything that people decided about a subject, and who is to review what, with the comments.

    Raises:
        ReviewError: it cannot be read.
    """
    if not has_log(subject_folder):
        return Reading(()), ()
    with open_log(subject_folder) as log:
        return log.reading(), log.work.reading()[0]


def unreadable_notes(rows: Sequence[UnreadableRow]) -> tuple[str, ...]:
    """What people should know about rows that are passed over, a sentence or two each.

    Args:
        rows: of the subject's log.
    """
    return tuple(f"{row.trial or 'an unknown trial'}: {row}" for row in rows)


def subject_key(subject_folder: Path) -> str:
    """What a subject is called in a shared database, on whichever machine and below whichever mount point.

    It is the folder's path below ADDB_VIEWER_ROOT, if that is set and the folder lies there; else its name.
    """
    folder, root = subject_folder.resolve(), os.environ.get(ROOT)
    if root and folder.is_relative_to(Path(root).resolve()):
        return folder.relative_to(Path(root).resolve()).as_posix()
    return folder.name


def record(log: "ReviewLog", files: TrialFiles, capture: Capture, event: Event, author: str) -> int:
    """Record a person's edit of a trial, on top of what its review.json says.

    The labels of the trial's review.json are taken into the log first, so that it holds all that was said.

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
        if capture.imported_reasons:
            _import_table(log, files, capture)
        else:
            missing, reviewed = capture.imported_missing_force, capture.imported_reviewed
            import_labels(log, files.name, missing, finished_by_file(files), reviewed)
    return log.append(files.name, event, author)


def take_in(log: "ReviewLog", files: TrialFiles, capture: Capture, table: ImportTable) -> int:
    """Record the labels of a table, in place of those of the trial's review.json and of tables before.

    Returns:
        The edit's number.

    Raises:
        ReviewError: it cannot be recorded.
    """
    return record(log, files, capture, table, IMPORTED)


@dataclass(frozen=True)
class Shared:
    """What became of a subject's own edits."""

    copied: int
    left: tuple[UnreadableRow, ...]  # that cannot be read, and are in the file alone


def share(subject_folder: Path, *, without_unreadable: bool = False) -> Shared:
    """Copy the edits of a subject's own file into the shared database.

    Args:
        subject_folder: whose.
        without_unreadable: copy the others where a row cannot be read; its decision stays in the file alone.

    Raises:
        ReviewError: there is no shared database or no file, a row of the file cannot be read, or the database
            has edits of the subject already.
    """
    if store_url() is None:
        raise ReviewError(f"no shared database is named; give its URL by --store or in {STORE}")
    if not (subject_folder / FILE).is_file():
        raise ReviewError(f"{subject_folder}: has no {FILE} to copy")
    from annotations.log import ReviewLog  # noqa: PLC0415 (likewise)

    with ReviewLog.open(subject_folder / FILE) as own, open_log(subject_folder) as shared:
        found = own.reading()
        if found.unreadable and not without_unreadable:
            raise ReviewError(
                f"{subject_folder / FILE}: nothing was copied, because what cannot be read would be missing "
                f"there: {listed(found.unreadable)} ({found.unreadable[0].why}). Update addb-viewer if a "
                "newer version wrote it, or put a whole copy of the file back; or share --without-unreadable"
            )
        copied = shared.take_over(found.edits)
        shared.work.take_over(own.work.reading()[0])
        return Shared(copied, found.unreadable)


def as_proposal(found: Found, provenance: Mapping[str, str]) -> Proposal:
    """A finding of ours as the log keeps it, with the version that found it.

    Args:
        found: by the detection.
        provenance: of the fit that it looked at.
    """
    start, end = found.range
    detector = f"{PROGRAM} {provenance.get(PROGRAM, '')}".strip()
    return Proposal(start, end, found.reason, found.foot, found.confidence, dict(found.evidence), detector)


def with_own_file(files: TrialFiles, capture: Capture, history: Sequence[Edit]) -> tuple[Edit, ...]:
    """A trial's edits, and before them its review.json as long as no import is among them.

    Args:
        files: of the trial.
        capture: the trial as read from them.
        history: its edits.
    """
    missing = capture.imported_missing_force
    if missing is None or any(edit.author == IMPORTED for edit in history):
        return tuple(history)
    labels: Event = labels_of(missing, finished=finished_by_file(files), reviewed=capture.imported_reviewed)
    if capture.imported_reasons:
        labels = _table(files, capture)
    return (Edit(0, files.name, IMPORTED, datetime.now(UTC), labels), *history)


def finished_by_file(files: TrialFiles) -> bool:
    """Whether somebody has finished the review beside the recording, or in its own file."""
    if files.inner_review_finished is not None and not files.reviews:
        return files.inner_review_finished
    return all((review.parent / FINISHED).exists() for review in files.reviews)


def _table(files: TrialFiles, capture: Capture) -> ImportTable:
    """A review that gives reasons, as the recording's own file has it: every frame is decided."""
    missing = capture.imported_missing_force
    assert missing is not None
    flagged = [FlagRange(start, end, reason) for start, end, reason in capture.imported_reasons]
    counts = [ClearRange(start, end) for start, end in true_runs(~missing)]
    status = Status.FINISHED if finished_by_file(files) else None
    return ImportTable(files.markers.name, PROGRAM, (*flagged, *counts), status=status)


def _import_table(log: "ReviewLog", files: TrialFiles, capture: Capture) -> None:
    """Take the file's review into the log, unless any import is there: the later one holds."""
    table = _table(files, capture)
    if log.last_import(files.name, ImportTable) is None:
        log.append(files.name, table, IMPORTED)


@cache
def _shared(url: str, _process: int) -> "Database":
    """One pool of connections for all subjects; a forked process makes its own."""
    from annotations.database import Database  # noqa: PLC0415 (likewise)

    return Database(url)
