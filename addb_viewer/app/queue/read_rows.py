"""A subject's rows of the queue, read from its fit, its review and its diagnosis."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from addb_viewer.app.queue.rows import Mark, Row, ShownProposal
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import finished_by_file, whole_logs
from addb_viewer.jobs.stored_solves import stored_solves, waiting_solves
from addb_viewer.text.diagnosis_vocabulary import ranges_of, title
from addb_viewer.trial_view.lanes import reviewed_ranges
from addb_viewer.trial_view.proposals import Pending, State, pending
from annotations.events import IMPORTED, Edit, SetStatus, Status
from annotations.folding import folded
from annotations.trial_review import TrialReview
from annotations.work import TrialWork, work_of
from solver.capture.capture import Subject, TrialFiles
from solver.common.errors import ResultsError, SolverError
from solver.common.small_files import json_content
from solver.contact.proposals import Proposal as Detected
from solver.fitting.results.kept_proposals import kept_proposals
from solver.fitting.results.store import default_folder


def subject_rows(name: str, subject: Subject, results: Path | None = None) -> list[Row]:
    """The trials of one subject, in its own order.

    Args:
        name: in the root.
        subject: opened.
        results: where its fit lies; inside the subject's folder by default.

    Raises:
        ReviewError: its review log cannot be read.
        SolverError: its figures cannot.
    """
    folder = results or default_folder(subject.folder)
    figures, proposals, causes = _figures(folder / "fit.json"), _proposals(folder), _causes(folder)
    whose = tuple(solve.by for solve in waiting_solves(stored_solves(folder)))
    log, work = whole_logs(subject.folder)
    rows = []
    for files in subject.trials:
        said = log.about(files.name)
        known = bool(said.edits) or any(row.trial == files.name for row in said.unreadable)
        review = folded(files.name, said.edits, subject.foot_bodies, said.unreadable) if known else None
        found = () if files.has_review and review is None else proposals.get(files.name, ())
        row = Row(name, files.name, *_status(files, review), figures.get(files.name), waiting=whose)
        row = _with_review(row, review or folded(files.name, (), subject.foot_bodies), found)
        row = _with_work(row, work_of([item for item in work if item.trial == files.name]))
        rows.append(replace(row, causes=causes.get(files.name, ()), marks=_marks(said.edits)))
    return rows


def _status(files: TrialFiles, review: TrialReview | None) -> tuple[Status, str | None]:
    if review is not None:
        return review.status, review.status_author
    imported = files.has_review and finished_by_file(files)
    return (Status.FINISHED, IMPORTED) if imported else (Status.UNSEEN, None)


def _with_review(row: Row, review: TrialReview, found: Sequence[Detected]) -> Row:
    """With what people decided, and what detection proposes beside it."""
    proposals = pending(found, review, {})
    waiting = [p for p in proposals if p.state is State.OPEN]
    return replace(
        row,
        proposed=len(waiting),
        doubtful=_doubtful(waiting, row),
        proposals=tuple(
            ShownProposal(p.proposal.start, p.proposal.end, p.proposal.confidence, str(p.state))
            for p in proposals
        ),
        reviewed=reviewed_ranges(review, row.frames),
        conflicts=tuple((c.start, c.end) for c in review.conflicts),
        activities=tuple(dict.fromkeys(a.label for a in review.activities)),
    )


def _with_work(row: Row, work: TrialWork) -> Row:
    return replace(
        row, assigned_to=work.assigned_to, open_comments=work.open_comments, comments=len(work.comments)
    )


def _marks(edits: Sequence[Edit]) -> tuple[Mark, ...]:
    """Who edited when: what people's pace is counted from; labels from files are nobody's work."""
    return tuple(
        Mark(
            edit.author,
            edit.made_at.timestamp(),
            isinstance(edit.event, SetStatus) and edit.event.status is Status.FINISHED,
        )
        for edit in edits
        if edit.author != IMPORTED
    )


def _doubtful(waiting: Sequence[Pending], row: Row) -> float:
    if not row.frames:
        return 0.0
    frames = sum((p.proposal.end - p.proposal.start) * p.proposal.confidence for p in waiting)
    return min(frames / row.frames, 1.0)


def _proposals(folder: Path) -> Mapping[str, Sequence[Detected]]:
    """What detection proposed; nothing where the fit is not whole, which opening a trial of it tells."""
    try:
        return kept_proposals(folder)
    except ResultsError:
        return {}


def _causes(folder: Path) -> dict[str, tuple[str, ...]]:
    """What the diagnosis names, by trial; nothing where it cannot be read, which its tab tells."""
    try:
        found = kept(folder)
    except ResultsError:
        return {}
    named: dict[str, list[str]] = {}
    for effect in found[0]["effects"] if found else ():
        for trial, _, _ in ranges_of(found[0], effect) if found else ():
            named.setdefault(trial, []).append(title(effect))
    return {trial: tuple(dict.fromkeys(titles)) for trial, titles in named.items()}


def _figures(path: Path) -> dict[str, Mapping[str, Any]]:
    """The figures of each trial in a fit; none where there is no fit."""
    try:
        trials = json_content(path)["trials"]
        return {trial["name"]: trial for trial in trials}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SolverError(f"{path}: cannot be read ({error}); fit the subject again") from error
