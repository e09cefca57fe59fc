"""What is said of a trial: by people, by rules, and by the last diagnosis."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from addb_viewer.dataset.grid import Grid
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import whole_log, with_own_file
from annotations.activities import ERRONEOUS
from annotations.events import IMPORTED, Edit, Status
from annotations.folding import folded
from annotations.suggested_activity import SuggestedActivity, open_suggestions
from annotations.trial_review import TrialReview
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.common.typed_json import plain
from solver.diagnosis.diagnosis_report import Cause
from solver.fitting.provenance import other_recordings, provenance_of
from solver.fitting.results.store import default_folder


def named_causes(subject: Subject) -> tuple[Cause, ...]:
    """The causes of its diagnosis; none where nobody has asked, or files have changed since.

    Raises:
        ResultsError: the kept diagnosis cannot be read.
    """
    found = kept(default_folder(subject.folder))
    if found is None:
        return ()
    figures, made_from = found
    if other_recordings(made_from["provenance"], provenance_of(subject, subject.trials)):
        return ()
    return figures.effects


def fingerprint(causes: Sequence[Cause]) -> str:
    """SHA-256 of what they say."""
    return hashlib.sha256(json.dumps(plain(tuple(causes)), sort_keys=True).encode()).hexdigest()


UNKNOWN = "none"  # activity of a frame of which nobody and no rule has said anything
NOBODY, BY_PERSON = "nobody", "person"
_TREADMILL, _OVERGROUND = ("treadmill",), ("overground", "incline")


@dataclass(frozen=True)
class Stretch:
    """Frames start to end − 1 of the recording and what the person does there."""

    start: int
    end: int
    activity: str
    subclass: str | None
    by: str  # person; or the kind of rule
    confidence: float | None = None  # 0 to 1, of a rule
    reviewer: str | None = None  # reviewer_1 …


@dataclass(frozen=True)
class TrialLabels:
    """Of one trial, in frames of the recording."""

    review: TrialReview
    frames: int
    reviewers: Mapping[str, str]  # what a release calls each author
    suggested: tuple[SuggestedActivity, ...] = ()  # by rules, of a solved trial

    @property
    def finished(self) -> bool:
        """Whether somebody has finished its review."""
        return self.review.status is Status.FINISHED

    @property
    def unusable(self) -> str:
        """For what somebody called it unusable, and why; empty where nobody did."""
        review = self.review
        return f"{review.unusable}: {review.status_note}" if review.unusable else ""

    def with_suggestions(self, suggested: Sequence[SuggestedActivity]) -> "TrialLabels":
        """Also what rules suggest; it holds where nobody has labelled, and nobody has refused it.

        Args:
            suggested: of the solved trial.
        """
        return replace(self, suggested=tuple(suggested))

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """Everything that is said, in order of time; no two overlap."""
        said = [
            Stretch(
                one.start,
                one.end,
                one.activity,
                one.subclass,
                BY_PERSON,
                reviewer=self.reviewers.get(one.author),
            )
            for one in self.review.activities
        ]
        said += [
            Stretch(one.start, one.end, one.activity, one.subclass, one.by, one.confidence)
            for one in open_suggestions(self.suggested, self.review)
        ]
        return tuple(sorted(said, key=lambda one: one.start))

    def of_frames(self, grid: Grid) -> tuple[list[str], list[str | None], list[str]]:
        """Activity, subclass and who says so, of each frame of the grid: the nearest native frame's."""
        said = np.zeros(self.frames, dtype=int)
        for k, one in enumerate(self.stretches, start=1):
            said[one.start : one.end] = k
        names: list[tuple[str, str | None, str]] = [(UNKNOWN, None, NOBODY)]
        names += [(one.activity, one.subclass, one.by) for one in self.stretches]
        at = grid.at_nearest(said)
        return [names[k][0] for k in at], [names[k][1] for k in at], [names[k][2] for k in at]

    @cached_property
    def _most(self) -> tuple[Stretch, ...]:
        """The stretches of what most frames are said to be, by whom; erroneous ones are left out."""
        of: dict[tuple[str, str, str], list[Stretch]] = {}
        for one in self.stretches:
            if one.activity != ERRONEOUS:
                of.setdefault((one.activity, one.subclass or "", one.by), []).append(one)
        lasts = {name: sum(one.end - one.start for one in stretches) for name, stretches in of.items()}
        return tuple(of[max(of, key=lambda name: (lasts[name], name))]) if of else ()

    @property
    def activity(self) -> str:
        """Of most labelled frames."""
        return self._most[0].activity if self._most else UNKNOWN

    @property
    def activity_sub(self) -> str | None:
        """Likewise the subclass."""
        return self._most[0].subclass if self._most else None

    @property
    def by(self) -> str:
        """Who or what says so."""
        return self._most[0].by if self._most else NOBODY

    @property
    def confidence(self) -> float | None:
        """Of a rule, the mean over its frames; None where a person, or nobody, says so."""
        known = [(one.confidence, one.end - one.start) for one in self._most if one.confidence is not None]
        if not known:
            return None
        values, lengths = zip(*known, strict=True)
        return float(np.average(values, weights=lengths))

    @property
    def trial_type(self) -> str:
        """Where the person moved, as far as the label tells."""
        if self.activity_sub in _TREADMILL:
            return "treadmill"
        if self.activity_sub in _OVERGROUND:
            return "overground"
        return "static" if self.activity == "standing" else "other"

    def reviewer_of(self, reason: str, foot: str | None, start: int, end: int, grid: Grid) -> str | None:
        """Who gave a reason of frames of the grid; None where no person did.

        Args:
            reason: in the review's words.
            foot: its body; None: all feet.
            start: first frame of the range.
            end: the first after it.
            grid: of the release.
        """
        first, last = int(grid.nearest[start]), int(grid.nearest[end - 1])
        for flag in self.review.flags:
            same = flag.reason == reason and (foot is None or flag.foot in (None, foot))
            if same and flag.start <= last and first < flag.end:
                return self.reviewers.get(flag.author)
        return None


def labels_of(
    subject: Subject, files: Sequence[TrialFiles], captures: Sequence[Capture], *, names: bool = False
) -> dict[str, TrialLabels]:
    """What people say of trials, by name; files that came with the recordings included.

    Args:
        subject: whose.
        files: of the trials.
        captures: the trials as read.
        names: whether reviewers are told by their own, instead of reviewer_1 …

    Raises:
        ReviewError: the log cannot be read.
    """
    log = whole_log(subject.folder)
    authors = sorted({edit.author for edit in log.edits} - {IMPORTED})
    reviewers = {author: author if names else f"reviewer_{k}" for k, author in enumerate(authors, start=1)}
    found = {}
    for trial, capture in zip(files, captures, strict=True):
        edits: tuple[Edit, ...] = with_own_file(trial, capture, log.about(trial.name).edits)
        review = folded(trial.name, edits, subject.foot_bodies)
        found[trial.name] = TrialLabels(review, capture.markers.frames, reviewers)
    return found
