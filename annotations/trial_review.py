"""What people have decided about one trial, as of now."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Shaped

from annotations.activities import ERRONEOUS, activity_words
from annotations.events import IMPORTED, Proposal, RefuseActivity, Status, Unusable
from annotations.reading import UnreadableRow
from annotations.review_errors import ReviewError

MissingRange = tuple[int, int, str | None, str]  # start, end, foot or None for all, reason


class Source(StrEnum):
    """Where a label comes from."""

    PERSON = "person"
    IMPORTED = "imported"
    ACCEPTED = "accepted proposal"
    REJECTED = "rejected proposal"
    UNDECIDED = "undecided proposal"  # of a finished trial: it stays left out


@dataclass(frozen=True, slots=True)
class FlaggedRange:
    """Frames start to end − 1 on which a foot's force, or all feet's, does not count."""

    start: int
    end: int
    foot: str | None
    reason: str
    source: Source
    author: str
    edit: int  # its number in the log
    note: str = ""
    confidence: float | None = None  # of the proposal that was accepted
    detector: str = ""  # that made it: name and version


@dataclass(frozen=True, slots=True)
class ClearedRange:
    """Frames start to end − 1 on which somebody has decided that the force counts."""

    start: int
    end: int
    foot: str | None
    source: Source
    author: str
    edit: int
    note: str = ""


@dataclass(frozen=True, slots=True)
class ActivityRange:
    """What the person does on frames start to end − 1."""

    start: int
    end: int
    activity: str
    subclass: str | None
    author: str
    edit: int
    note: str = ""

    @property
    def label(self) -> str:
        """Activity and subclass in one."""
        return activity_words(self.activity, self.subclass)


@dataclass(frozen=True, slots=True)
class Opinion:
    """One reviewer's present label of a range, in words."""

    author: str
    label: str
    edit: int


@dataclass(frozen=True, slots=True)
class Conflict:
    """Two reviewers label the same frames differently; the later label counts."""

    start: int
    end: int
    foot: str | None  # None for all, and for activities
    earlier: Opinion
    later: Opinion

    def __str__(self) -> str:
        of_foot = f", {self.foot}" if self.foot else ""
        return (
            f"frames {self.start} to {self.end - 1}{of_foot}: {self.earlier.author} says "
            f"'{self.earlier.label}' (edit {self.earlier.edit}), {self.later.author} says "
            f"'{self.later.label}' (edit {self.later.edit}); the later one, {self.later.author}'s, counts"
        )


@dataclass(frozen=True)
class TrialReview:
    """The present state of one trial's review; `annotations.folding.folded` makes it from the log."""

    trial: str
    feet: tuple[str, ...]
    status: Status
    status_author: str | None  # None while nobody has said anything
    decided: bool  # a person, or a table that one took in, has judged forces or taken the trial in hand
    status_note: str = ""
    unusable: Unusable | None = None  # what the trial must not be used for; the note says why
    flags: tuple[FlaggedRange, ...] = ()  # a foot's ranges do not overlap
    cleared: tuple[ClearedRange, ...] = ()  # nor do these, nor the two with each other
    activities: tuple[ActivityRange, ...] = ()  # nor do these
    conflicts: tuple[Conflict, ...] = ()
    accepted: tuple[Proposal, ...] = ()
    rejected: tuple[Proposal, ...] = ()
    refused_activities: tuple[RefuseActivity, ...] = ()  # which a program had suggested
    stays_out: tuple[FlaggedRange, ...] | None = None
    """Of a finished trial: what a detector left out and nobody decided. None: detection is still asked."""
    file_counts: tuple[tuple[int, int], ...] | None = None
    """Where an imported review.json says that every force counts; None: none was imported."""
    unreadable: tuple[UnreadableRow, ...] = ()
    """Rows of the log that may be about the trial and cannot be read: nothing of this is in the state."""

    @property
    def missing_ranges(self) -> tuple[MissingRange, ...]:
        """Where forces must not be used, as far as is known here: flags, erroneous, what stays out."""
        left_out = (*self.flags, *(self.stays_out or ()))
        flagged = [(flag.start, flag.end, flag.foot, flag.reason) for flag in left_out]
        erroneous = [(a.start, a.end, None, ERRONEOUS) for a in self.activities if a.activity == ERRONEOUS]
        return tuple(sorted([*flagged, *erroneous], key=lambda missing: missing[:2]))

    @property
    def is_imported(self) -> bool:
        """Whether labels came from a file: a review.json or a table."""
        return self.file_counts is not None

    def missing(self, frames: int) -> Bool[np.ndarray, "frames feet"]:
        """True where a foot's force is missing or wrong.

        Args:
            frames: of the trial.

        Raises:
            ReviewError: a label lies beyond the trial's end.
        """
        missing = np.zeros((frames, len(self.feet)), dtype=bool)
        for start, end, foot, _ in self.missing_ranges:
            self._check_end(start, end, frames)
            missing[start:end, self.lane(foot)] = True
        return missing

    def judged(self, frames: int, *, by_files: bool = False) -> Bool[np.ndarray, "frames feet"]:
        """True where a person has decided whether a foot's force counts, in whichever way.

        Args:
            frames: of the trial; labels beyond its end are left out.
            by_files: likewise where an imported review has.
        """
        judged = np.zeros((frames, len(self.feet)), dtype=bool)
        labels: tuple[FlaggedRange | ClearedRange, ...] = (*self.flags, *self.cleared)
        for label in labels:
            if by_files or label.author != IMPORTED:
                judged[label.start : label.end, self.lane(label.foot)] = True
        for start, end in (self.file_counts or ()) if by_files else ():
            judged[start:end] = True
        return judged

    def activity_labels(self, frames: int) -> Shaped[np.ndarray, " frames"]:
        """Activity and subclass of every frame, as text; empty where nobody has said.

        Args:
            frames: of the trial.

        Raises:
            ReviewError: a label lies beyond the trial's end.
        """
        labels = np.full(frames, "", dtype=object)
        for activity in self.activities:
            self._check_end(activity.start, activity.end, frames)
            labels[activity.start : activity.end] = activity.label
        return labels.astype(str)

    def conflicts_of(self, edit: int) -> tuple[Conflict, ...]:
        """The conflicts that an edit is a part of.

        Args:
            edit: its number.
        """
        return tuple(c for c in self.conflicts if edit in (c.earlier.edit, c.later.edit))

    def lane(self, foot: str | None) -> slice | int:
        """The foot's column; all where it is None."""
        return slice(None) if foot is None else self.feet.index(foot)

    def _check_end(self, start: int, end: int, frames: int) -> None:
        if end > frames:
            raise ReviewError(
                f"{self.trial}: frames {start} to {end - 1} are labelled, but the trial has {frames}; "
                "undo that label, or bring back the recording that it is about"
            )
