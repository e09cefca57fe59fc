"""A subject's review log as this program uses it: where it lies, how an edit enters it, what a solve gets."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from addb_viewer.environment import ROOT, STORE
from annotations.database import Database, is_url
from annotations.errors import ReviewError
from annotations.events import IMPORTED, ClearRange, Edit, Event, FlagRange, ImportTable, Proposal, Status
from annotations.folding import folded
from annotations.log import ReviewLog
from annotations.reading import Reading
from annotations.review_json import FINISHED, import_labels, labels_of
from annotations.runs import true_runs
from annotations.trial_review import TrialReview
from annotations.unreadable import UnreadableRow, listed
from annotations.work import WorkItem
from solver.capture.atomic import made_folder
from solver.capture.b3d.places import recording_of
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.mask import ERRONEOUS
from solver.contact.proposals import Proposal as Found
from solver.settings import settings_for

PROGRAM = "addb-viewer"
FILE = "annotations.sqlite"


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


def whole_logs(subject_folder: Path) -> tuple[Reading, tuple[WorkItem, ...]]:
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


def record(log: ReviewLog, files: TrialFiles, capture: Capture, event: Event, author: str) -> int:
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


def take_in(log: ReviewLog, files: TrialFiles, capture: Capture, table: ImportTable) -> int:
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


def force_review(review: TrialReview) -> ForceReview:
    """What a trial's review says about forces, as the solver takes it.

    Args:
        review: its present state.
    """
    said = [
        *((flag.author, ForceLabel(flag.start, flag.end, flag.foot, flag.reason)) for flag in review.flags),
        *((c.author, ForceLabel(c.start, c.end, c.foot, None)) for c in review.cleared),
        *(
            (a.author, ForceLabel(a.start, a.end, None, ERRONEOUS))
            for a in review.activities
            if a.activity == ERRONEOUS
        ),
    ]
    counts = [ForceLabel(start, end, None, None) for start, end in review.file_counts or ()]
    stays_out = review.stays_out
    return ForceReview(
        by_people=tuple(label for author, label in said if author != IMPORTED),
        by_file=(*counts, *(label for author, label in said if author == IMPORTED))
        if review.is_imported
        else None,
        stays_out=None if stays_out is None else tuple((f.start, f.end, f.foot, f.reason) for f in stays_out),
    )


def left_undecided(
    review: TrialReview, found: Sequence[Found], frames: int, confidence: float, provenance: Mapping[str, str]
) -> tuple[Proposal, ...]:
    """What detection leaves out of a trial and neither a person nor a file has decided.

    Args:
        review: of the trial, its review.json included.
        found: what detection proposes.
        frames: of the trial.
        confidence: from which on a proposal is left out (`[detection] confidence`).
        provenance: of the fit that detection looked at.
    """
    judged = review.judged(frames, by_files=True)

    def is_undecided(proposal: Found) -> bool:
        lane = slice(None) if proposal.foot is None else review.feet.index(proposal.foot)
        return not judged[slice(*proposal.range), lane].all()

    ours = [p for p in found if p.confidence >= confidence and (p.foot is None or p.foot in review.feet)]
    return tuple(as_proposal(p, provenance) for p in ours if is_undecided(p))


def undecided(
    subject: Subject, files: TrialFiles, capture: Capture, history: Sequence[Edit]
) -> tuple[Proposal, ...] | None:
    """Likewise, as the kept fit's detection has it; None where the trial has not been fitted.

    Args:
        subject: whose.
        files: of the trial.
        capture: the trial as read from them.
        history: the trial's edits.

    Raises:
        SolverError: the fit, or the subject's settings.toml, cannot be read.
    """
    from solver.results.kept_proposals import kept_proposals  # noqa: PLC0415 (slow; few who read reviews ask)
    from solver.results.store import default_folder  # noqa: PLC0415 (likewise)

    found = kept_proposals(default_folder(subject.folder))
    if files.name not in found:
        return None
    review = folded(files.name, with_own_file(files, capture, history), subject.foot_bodies)
    confidence = settings_for(subject.folder).detection.confidence
    return left_undecided(review, found[files.name], capture.markers.frames, confidence, {})


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


def reviews_for_solve(
    subject: Subject, trials: Sequence[TrialFiles]
) -> tuple[dict[str, ForceReview], tuple[str, ...]]:
    """What people decided about trials, as the solver takes it, and what they should know about it.

    Args:
        subject: whose.
        trials: those to be solved.

    Returns:
        What they say by trial, only of trials about whose forces they say something; and notes: where
        reviewers disagree, edits that are not used, and rows that cannot be read.

    Raises:
        ReviewError: the log cannot be read, or is about a foot that the subject does not have.
    """
    if not has_log(subject.folder):
        return {}, ()
    found = whole_log(subject.folder)
    about = {trial.name: found.about(trial.name) for trial in trials}
    reviews = [folded(name, said.edits, subject.foot_bodies, said.unreadable) for name, said in about.items()]
    known = {trial.name for trial in subject.trials}
    gone = sorted({edit.trial for edit in found.edits} - known)
    notes = [f"{review.trial}: {conflict}" for review in reviews for conflict in review.conflicts]
    wanted = {trial.name for trial in trials} | {""}
    notes += unreadable_notes([r for r in found.unreadable if r.trial in wanted or r.trial not in known])
    if gone:
        place = FILE if store_url() is None else "the shared database"
        notes.append(f"{place}: has edits of trials that the subject does not have: {', '.join(gone)}")
    if store_url() is not None and (subject.folder / FILE).is_file():
        notes.append(
            f"{FILE}: not used, because reviews are kept in a shared database; `share` copies it there"
        )
    said = {review.trial: force_review(review) for review in reviews}
    return {trial: review for trial, review in said.items() if review != ForceReview()}, tuple(notes)


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


def _import_table(log: ReviewLog, files: TrialFiles, capture: Capture) -> None:
    """Take the file's review into the log, unless any import is there: the later one holds."""
    table = _table(files, capture)
    if log.last_import(files.name, ImportTable) is None:
        log.append(files.name, table, IMPORTED)


@cache
def _shared(url: str, _process: int) -> Database:
    """One pool of connections for all subjects; a forked process makes its own."""
    return Database(url)
