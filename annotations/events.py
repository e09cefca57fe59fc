"""What an edit may say. An edit is never changed or removed; taking one back is an edit too."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum

from annotations.activities import activity_words, checked_activity
from annotations.reasons import checked_reason
from annotations.review_errors import ReviewError

IMPORTED = "imported"  # the reviewer under whose name labels from files are kept
LONGEST_NAME = 100  # characters of a person's name


class Status(StrEnum):
    """How far the review of a trial has come."""

    UNSEEN = "unseen"
    IN_WORK = "in work"
    FINISHED = "finished"
    SECOND_LOOK = "needs a second look"


class Unusable(StrEnum):
    """What a trial must not be used for, whatever its figures say."""

    TORQUES = "torques"
    ANGLES = "angles"
    BOTH = "angles and torques"


@dataclass(frozen=True)
class FrameRange:
    """Frames start to end − 1 of a trial, counted from 0."""

    start: int
    end: int

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.end:
            raise ReviewError(
                f"no frames in {self.start}:{self.end}; give START:END with START at least 0 and below END"
            )


@dataclass(frozen=True)
class MissingForce(FrameRange):
    """The force of a foot, or of all feet, is missing or wrong on these frames, for a reason of the list."""

    reason: str
    foot: str | None = None  # name of the foot's body; None for all

    def __post_init__(self) -> None:
        super().__post_init__()
        checked_reason(self.reason)


@dataclass(frozen=True)
class NamedActivity(FrameRange):
    """An activity of the list, on these frames."""

    activity: str
    subclass: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        checked_activity(self.activity, self.subclass)

    @property
    def label(self) -> str:
        """Activity and subclass in one."""
        return activity_words(self.activity, self.subclass)


@dataclass(frozen=True)
class FlagRange(MissingForce):
    """A person flags the force as missing or wrong."""

    note: str = ""


@dataclass(frozen=True)
class ClearRange(FrameRange):
    """The force of a foot, or of all feet, counts on these frames."""

    foot: str | None = None
    note: str = ""


@dataclass(frozen=True)
class Proposal(MissingForce):
    """What a detector believes about a range, with the numbers that it rests on."""

    confidence: float = 1.0  # 0 to 1
    evidence: Mapping[str, float] = field(default_factory=dict)
    detector: str = ""  # its name and version


@dataclass(frozen=True)
class AcceptProposal:
    """A person agrees with a detector: the force is missing there."""

    proposal: Proposal


@dataclass(frozen=True)
class RejectProposal:
    """A person disagrees with a detector: the force counts, wherever nobody has flagged it by hand."""

    proposal: Proposal


@dataclass(frozen=True)
class SetActivity(NamedActivity):
    """What the person does on these frames."""

    note: str = ""


@dataclass(frozen=True)
class ClearActivity(FrameRange):
    """Nothing is said about what the person does on these frames."""


@dataclass(frozen=True)
class RefuseActivity(NamedActivity):
    """A person refuses what a program suggested about these frames; it is not suggested again."""


@dataclass(frozen=True)
class SetStatus:
    """How far the review of the trial has come."""

    status: Status
    note: str = ""
    left_out: tuple[Proposal, ...] | None = None
    """Of a finished trial: what a detector left out and nobody had decided; it stays left out. None: nothing
    had been detected yet, and what will be stays left out."""
    unusable: Unusable | None = None  # of a finished trial; the note says why

    def __post_init__(self) -> None:
        if self.unusable is not None and not (self.status is Status.FINISHED and self.note.strip()):
            raise ReviewError("a trial is marked unusable when it is finished, and with a reason")


@dataclass(frozen=True)
class ImportLabels:
    """All labels of another program's review of the trial, in place of those imported before."""

    missing: tuple[tuple[int, int], ...]  # ranges of frames without force, all feet
    frames: int  # of the trial that they are about
    finished: bool  # a person had finished that review
    unreviewed: tuple[tuple[int, int], ...] = ()  # ranges that the review is not about

    def __post_init__(self) -> None:
        if any(not start < end <= self.frames for start, end in (*self.missing, *self.unreviewed)):
            raise ReviewError(f"it labels frames that are not among its {self.frames}")


@dataclass(frozen=True)
class ImportTable:
    """All labels of a trial in a table of ranges, in place of those imported before."""

    file: str  # its name
    by: str  # who took it in
    ranges: tuple[FlagRange | ClearRange, ...]
    activities: tuple[SetActivity, ...] = ()
    status: Status | None = None  # None: the table says nothing about it
    status_note: str = ""


@dataclass(frozen=True)
class Undo:
    """The edit of this number no longer counts."""

    edit: int


@dataclass(frozen=True)
class Redo:
    """The undone edit of this number counts again."""

    edit: int


Event = (
    FlagRange
    | ClearRange
    | AcceptProposal
    | RejectProposal
    | SetActivity
    | ClearActivity
    | RefuseActivity
    | SetStatus
    | ImportLabels
    | ImportTable
    | Undo
    | Redo
)


@dataclass(frozen=True)
class Edit:
    """One line of the log. Numbers grow with time, over all trials of a database."""

    number: int
    trial: str
    author: str
    made_at: datetime  # UTC
    event: Event
