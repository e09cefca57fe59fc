"""The queue: every trial of the root with how bad it is and how far its review, worst first."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from addb_viewer.app.jobs.stored_solves import stored_solves, waiting_solves
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.app.trial.proposals import Pending, State, pending
from addb_viewer.review_store import finished_by_file, whole_log
from annotations.events import IMPORTED, Status
from annotations.folding import folded
from annotations.trial_review import TrialReview
from solver.capture.capture import Subject
from solver.capture.small_files import json_content
from solver.contact.proposals import Proposal as Detected
from solver.contact.wrenches import DETECTION, NOBODY
from solver.dynamics.thresholds import Thresholds
from solver.errors import ResultsError, SolverError
from solver.results.kept_proposals import kept_proposals
from solver.results.store import default_folder


@dataclass(frozen=True)
class Row:
    """One trial."""

    subject: str
    trial: str
    status: Status = Status.UNSEEN
    by: str | None = None  # who set it
    figures: Mapping[str, Any] | None = None  # in the shape of `fit --json`, of the trial; None: no fit
    proposed: int = 0  # proposals of the detection that nobody has decided
    doubtful: float = 0.0  # share of the frames that they cover, each weighted by how sure it is
    waiting: tuple[str, ...] = ()  # whose new solves wait to be kept or discarded
    error: str = ""  # why nothing is known

    @property
    def finished(self) -> bool:
        """Whether the review is done."""
        return self.status is Status.FINISHED

    @property
    def residual(self) -> float | None:
        """The larger of force and moment in units of its bound; None where no forces were used."""
        if self.figures is None:
            return None
        limits = Thresholds()
        linear, angular = self.figures.get("linear_residual"), self.figures.get("angular_residual")
        if not linear or not angular:
            return None
        return float(max(linear["rms_BW"] / limits.linear_BW, angular["rms_BWh"] / limits.angular_BWh))

    @property
    def left_out(self) -> float | None:
        """Share of the frames whose forces the fit did not use; None without a fit."""
        if self.figures is None or not self.figures.get("frames"):
            return None
        return 1.0 - float(self.figures["frames_with_force_used"]) / float(self.figures["frames"])

    @property
    def undecided(self) -> bool:
        """Whether a machine, or nobody, said of some frames which forces count."""
        if self.figures is None:
            return False
        sources = str(self.figures.get("mask_source", NOBODY)).split(" + ")
        return DETECTION in sources or NOBODY in sources

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


class Filter(StrEnum):
    """Which trials the queue shows."""

    ALL = "all"
    TO_DO = "to review"
    SECOND_LOOK = "second look"
    FINISHED = "finished"


def order(row: Row) -> tuple[bool, float, str]:
    """Where a row stands; equally bad trials of a subject stay in the subject's own order."""
    return row.finished, -row.badness, row.subject


def shown(rows: Sequence[Row], which: Filter, words: str = "") -> list[Row]:
    """The rows that a filter lets through.

    Args:
        rows: in order.
        which: by status.
        words: all of which must be in the subject's or the trial's name.
    """
    wanted = {
        Filter.ALL: lambda row: True,
        Filter.TO_DO: lambda row: not row.finished,
        Filter.SECOND_LOOK: lambda row: row.status is Status.SECOND_LOOK,
        Filter.FINISHED: lambda row: row.finished,
    }[which]
    sought = words.lower().split()
    return [
        row for row in rows if wanted(row) and all(w in f"{row.subject} {row.trial}".lower() for w in sought)
    ]


def next_trial(rows: Sequence[Row], here: TrialPlace | None, taken: Collection[TrialPlace]) -> Row | None:
    """The next trial that waits for a person and that nobody else is on; None: there is none.

    Args:
        rows: of the queue, in order.
        here: subject and trial on the screen: those after it come first; None: from the top.
        taken: where others are.
    """
    places = [(row.subject, row.trial) for row in rows]
    after = places.index(here) + 1 if here in places else 0
    waiting = to_review((*rows[after:], *rows[:after]), here)
    return next((row for row in waiting if (row.subject, row.trial) not in taken), None)


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
    folder = results or default_folder(subject.folder)
    figures, proposals = _figures(folder / "fit.json"), _proposals(folder)
    whose = tuple(solve.by for solve in waiting_solves(stored_solves(folder)))
    log, reviews = whole_log(subject.folder), dict[str, TrialReview]()
    for trial in {edit.trial for edit in log.edits} | {row.trial for row in log.unreadable}:
        said = log.about(trial)
        reviews[trial] = folded(trial, said.edits, subject.foot_bodies, said.unreadable)
    rows = []
    for files in subject.trials:
        imported = files.has_review and finished_by_file(files)
        status, by = (Status.FINISHED, IMPORTED) if imported else (Status.UNSEEN, None)
        review = reviews.get(files.name)
        if review is not None:
            status, by = review.status, review.status_author
        found = () if files.has_review and review is None else proposals.get(files.name, ())
        seen = review or folded(files.name, (), subject.foot_bodies)
        waiting = [p for p in pending(found, seen, {}) if p.state is State.OPEN]
        row = Row(name, files.name, status, by, figures.get(files.name), len(waiting))
        rows.append(replace(row, doubtful=_doubtful(waiting, row), waiting=whose))
    return rows


def _doubtful(waiting: Sequence[Pending], row: Row) -> float:
    if row.figures is None or not row.figures.get("frames"):
        return 0.0
    frames = sum((p.proposal.end - p.proposal.start) * p.proposal.confidence for p in waiting)
    return min(frames / float(row.figures["frames"]), 1.0)


def _proposals(folder: Path) -> Mapping[str, Sequence[Detected]]:
    """What detection proposed; nothing where the fit is not whole, which opening a trial of it tells."""
    try:
        return kept_proposals(folder)
    except ResultsError:
        return {}


def _figures(path: Path) -> dict[str, Mapping[str, Any]]:
    """The figures of each trial in a fit; none where there is no fit."""
    try:
        trials = json_content(path)["trials"]
        return {trial["name"]: trial for trial in trials}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SolverError(f"{path}: cannot be read ({error}); fit the subject again") from error
