"""What people say of a trial: whether its review is finished, what the person does, and who said so."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from addb_viewer.dataset.grid import Grid
from addb_viewer.review_store import whole_log, with_own_file
from annotations.activities import ERRONEOUS
from annotations.events import IMPORTED, Edit, Status
from annotations.folding import folded
from annotations.trial_review import TrialReview
from solver.capture.capture import Capture, Subject, TrialFiles

UNKNOWN = "none"  # activity of a frame of which nobody has said anything
NOBODY, BY_PERSON = "nobody", "person"
_TREADMILL, _OVERGROUND = ("treadmill",), ("overground", "incline")


@dataclass(frozen=True)
class TrialLabels:
    """Of one trial, in frames of the recording."""

    review: TrialReview
    frames: int
    reviewers: Mapping[str, str]  # what a release calls each author

    @property
    def finished(self) -> bool:
        """Whether somebody has finished its review."""
        return self.review.status is Status.FINISHED

    def of_frames(self, grid: Grid) -> tuple[list[str], list[str | None]]:
        """Activity and subclass of each frame of the grid: the nearest native frame's."""
        said = np.zeros(self.frames, dtype=int)
        for k, one in enumerate(self.review.activities, start=1):
            said[one.start : one.end] = k
        names: list[tuple[str, str | None]] = [(UNKNOWN, None)]
        names += [(one.activity, one.subclass) for one in self.review.activities]
        at = grid.at_nearest(said)
        return [names[k][0] for k in at], [names[k][1] for k in at]

    @property
    def _most(self) -> tuple[str, str | None]:
        """What most frames are labelled as; erroneous ones are left out of a release."""
        lengths: dict[tuple[str, str | None], int] = {}
        for one in self.review.activities:
            if one.activity != ERRONEOUS:
                name = one.activity, one.subclass
                lengths[name] = lengths.get(name, 0) + one.end - one.start
        return max(lengths, key=lambda name: (lengths[name], name[0])) if lengths else (UNKNOWN, None)

    @property
    def activity(self) -> str:
        """Of most labelled frames."""
        return self._most[0]

    @property
    def activity_sub(self) -> str | None:
        """Likewise the subclass."""
        return self._most[1]

    @property
    def by(self) -> str:
        """Who says so."""
        return NOBODY if self.activity == UNKNOWN else BY_PERSON

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
    subject: Subject, files: Sequence[TrialFiles], captures: Sequence[Capture]
) -> dict[str, TrialLabels]:
    """What people say of trials, by name; files that came with the recordings included.

    Args:
        subject: whose.
        files: of the trials.
        captures: the trials as read.

    Raises:
        ReviewError: the log cannot be read.
    """
    log = whole_log(subject.folder)
    authors = sorted({edit.author for edit in log.edits} - {IMPORTED})
    reviewers = {author: f"reviewer_{k}" for k, author in enumerate(authors, start=1)}
    found = {}
    for trial, capture in zip(files, captures, strict=True):
        edits: tuple[Edit, ...] = with_own_file(trial, capture, log.about(trial.name).edits)
        review = folded(trial.name, edits, subject.foot_bodies)
        found[trial.name] = TrialLabels(review, capture.markers.frames, reviewers)
    return found
