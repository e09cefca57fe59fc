"""The queue's rows: read from each trial's fit, review and diagnosis; their order and filters."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.jobs.review_store import finished_by_file, whole_logs
from addb_viewer.text.diagnosis_vocabulary import short_title
from addb_viewer.trial_view.kept_verdicts import results_of, review_in
from addb_viewer.trial_view.lanes import reviewed_ranges
from addb_viewer.trial_view.proposals import Pending, State, pending
from addb_viewer.trial_view.trial_verdict import TrialVerdict
from annotations.events import IMPORTED, Edit, SetStatus, Status
from annotations.folding import folded
from annotations.trial_review import TrialReview
from annotations.work import TrialWork, work_of
from solver.capture.capture import Subject, TrialFiles
from solver.contact.detected_ranges import Proposal as Detected
from solver.contact.wrenches import DETECTION, NOBODY
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.dynamics.thresholds import Thresholds
from solver.fitting.fit_summary import TrialFigures
from solver.fitting.verdict import Use

RECENT_S = 900.0  # who edited a trial so short a time ago is still on it, in whichever app

Range = tuple[int, int]  # frames: the first, and the first after it


class ShownProposal(NamedTuple):
    """A proposal of the detection."""

    start: int
    end: int
    confidence: float
    state: str  # open, accepted, rejected


class Mark(NamedTuple):
    """Somebody edited the review."""

    author: str
    at: float  # [s] since 1970
    finished: bool  # whether the edit finished the trial


@dataclass(frozen=True)
class Row:
    """One trial."""

    subject: str
    trial: str
    status: Status = Status.UNSEEN
    by: str | None = None  # who set it
    figures: TrialFigures | None = None  # None: no fit
    proposed: int = 0  # proposals of the detection that nobody has decided
    doubtful: float = 0.0  # share of the frames that they cover, each weighted by how sure it is
    waiting: tuple[str, ...] = ()  # whose new solves wait to be kept or discarded
    error: str = ""  # why nothing is known
    proposals: tuple[ShownProposal, ...] = ()
    reviewed: tuple[Range, ...] = ()  # frames about which a person has decided
    conflicts: tuple[Range, ...] = ()  # frames about which two people disagree
    activities: tuple[str, ...] = ()  # what the person does, as people labelled it
    causes: tuple[str, ...] = ()  # what the diagnosis names in it
    assigned_to: str = ""  # who is to review it; empty: nobody in particular
    open_comments: int = 0  # comments that are not settled
    comments: int = 0
    marks: tuple[Mark, ...] = ()  # people's edits
    verdict: TrialVerdict | None = None  # None: the subject cannot be read

    @property
    def frames(self) -> int:
        """Of the trial; 0 without a fit."""
        return 0 if self.figures is None else self.figures.frames

    def left_to(self, me: str, here: Collection[str], now: float) -> str:
        """Whose the trial is, if not this person's: it is assigned, or somebody edited it elsewhere just now.

        Args:
            me: who asks.
            here: names of those at a page of this app, of whom it is known which trial they are on.
            now: [s] since 1970.
        """
        if self.assigned_to:
            return "" if self.assigned_to == me else self.assigned_to
        last = max(self.marks, key=lambda mark: mark.at, default=None)
        if last is None or last.author in (me, *here) or now - last.at > RECENT_S:
            return ""
        return last.author

    @property
    def sources(self) -> tuple[str, ...]:
        """Who said which forces count; none without a fit."""
        return () if self.figures is None else self.figures.masks

    @property
    def finished(self) -> bool:
        """Whether the review is done."""
        return self.status is Status.FINISHED

    @property
    def residual(self) -> float | None:
        """The larger of force and moment in units of its bound; None where no forces were used."""
        if self.figures is None:
            return None
        limits, force, moment = Thresholds(), self.figures.force_BW, self.figures.moment_BWh
        if force is None or moment is None:
            return None
        return max(force / limits.linear_BW, moment / limits.angular_BWh)

    @property
    def left_out(self) -> float | None:
        """Share of the frames whose forces the fit did not use; None without a fit."""
        if self.figures is None or not self.frames:
            return None
        return 1.0 - self.figures.frames_with_force_used / self.frames

    @property
    def undecided(self) -> bool:
        """Whether a machine, or nobody, said of some frames which forces count."""
        return DETECTION in self.sources or NOBODY in self.sources

    @property
    def badness(self) -> float:
        """How much the trial needs a person; larger first.

        Residual in units of its bound, plus the share of frames left out, plus that under open proposals; a
        trial without a fit comes before all fitted ones, one that nobody has decided about before one that
        somebody has.
        """
        if self.figures is None:
            return 100.0
        residual = 2.0 if self.residual is None else min(self.residual, 50.0)
        return residual + (self.left_out or 0.0) + self.doubtful + (1.0 if self.undecided else 0.0)


WORST_FIRST = (Use.UNKNOWN, Use.NOTHING, Use.ANGLES, Use.TORQUES)


def order(row: Row) -> tuple[bool, int, float, str]:
    """Where a row stands: by its verdict, by how much it needs a person, in the subject's own order."""
    use = Use.UNKNOWN if row.verdict is None else row.verdict.verdict.use
    return row.finished, WORST_FIRST.index(use), -row.badness, row.subject


def next_trial(rows: Sequence[Row], here: TrialPlace | None, taken: Collection[TrialPlace]) -> Row | None:
    """The next trial that waits for a person and that nobody else is on, a fitted one if any; None: none.

    Args:
        rows: of the queue, in order.
        here: subject and trial on the screen: those after it come first; None: from the top.
        taken: where others are.
    """
    places = [(row.subject, row.trial) for row in rows]
    after = places.index(here) + 1 if here in places else 0
    waiting = to_review((*rows[after:], *rows[:after]), here)
    free = [row for row in waiting if (row.subject, row.trial) not in taken]
    return next((row for row in free if row.figures is not None), next(iter(free), None))


def to_review(rows: Sequence[Row], here: TrialPlace | None) -> list[Row]:
    """The trials that are not finished, but for the one on the screen, whoever is on them."""
    return [row for row in rows if not (row.finished or row.error or (row.subject, row.trial) == here)]


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
    kept = results_of(subject, results)
    log, work = whole_logs(subject.folder)
    rows = []
    for files in subject.trials:
        said = log.about(files.name)
        review = review_in(log, files, subject)
        found = kept.proposals(files, review)
        status, figures = _status(files, review), kept.figures.get(files.name)
        row = Row(name, files.name, *status, figures, waiting=kept.waiting)
        row = _with_review(row, review or folded(files.name, (), subject.foot_bodies), found)
        row = _with_work(row, work_of([item for item in work if item.trial == files.name]))
        causes, verdict = _causes_in(kept.report, files.name), kept.verdict(files.name, review, row.proposed)
        rows.append(replace(row, causes=causes, marks=_marks(said.edits), verdict=verdict))
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


def _causes_in(report: DiagnosisReport | None, trial: str) -> tuple[str, ...]:
    """What the diagnosis names in a trial."""
    effects = () if report is None else report.effects
    return tuple(dict.fromkeys(short_title(e) for e in effects if trial in {name for name, _, _ in e.frames}))
