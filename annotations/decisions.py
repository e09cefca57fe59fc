"""What each edit says about which frames: the pieces that the present state is laid together from."""

from collections.abc import Sequence
from typing import NamedTuple

from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Edit,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    RejectProposal,
    SetActivity,
)
from annotations.reasons import FORCE_COUNTS, MANUAL_REVIEW
from annotations.trial_review import Source

UNSAID = ""  # label of frames about whose activity somebody has taken the word back


class Decision(NamedTuple):
    """One label of a range of frames, and whose; hundreds are made for every picture of a trial's state."""

    start: int
    end: int
    foot: str | None  # None for all, and for activities
    label: str  # a reason, or that the force counts; of activities the class
    edit: int
    author: str
    source: Source = Source.PERSON
    subclass: str | None = None
    note: str = ""
    proposal: Proposal | None = None

    @property
    def words(self) -> str:
        """The label as people read it."""
        return f"{self.label} {self.subclass}" if self.subclass else self.label or "nothing"


def force_decisions(edit: Edit) -> Sequence[Decision]:
    """What an edit says about forces; one decision, or one a range of a table."""
    event, who = edit.event, (edit.number, edit.author)
    match event:
        case FlagRange() | ClearRange():
            return (_of_range(event, who, Source.PERSON),)
        case AcceptProposal(p):
            return (Decision(p.start, p.end, p.foot, p.reason, *who, source=Source.ACCEPTED, proposal=p),)
        case RejectProposal(p):
            return (Decision(p.start, p.end, p.foot, FORCE_COUNTS, *who, source=Source.REJECTED, proposal=p),)
        case ImportLabels(missing):
            return [
                Decision(start, end, None, MANUAL_REVIEW, *who, source=Source.IMPORTED)
                for start, end in missing
            ]
        case ImportTable():
            return [_of_range(labelled, who, Source.IMPORTED) for labelled in event.ranges]
        case _:
            return ()


def activity_decisions(edit: Edit) -> Sequence[Decision]:
    """What an edit says about activities."""
    event, who = edit.event, (edit.number, edit.author)
    match event:
        case SetActivity():
            return (_of_activity(event, who, Source.PERSON),)
        case ClearActivity(start, end):
            return (Decision(start, end, None, UNSAID, *who),)
        case ImportTable():
            return [_of_activity(activity, who, Source.IMPORTED) for activity in event.activities]
        case _:
            return ()


def replaces_imports(edit: Edit) -> bool:
    """Whether an edit takes the place of all that was imported before."""
    return isinstance(edit.event, ImportLabels | ImportTable)


def _of_range(labelled: FlagRange | ClearRange, who: tuple[int, str], source: Source) -> Decision:
    label = labelled.reason if isinstance(labelled, FlagRange) else FORCE_COUNTS
    return Decision(
        labelled.start, labelled.end, labelled.foot, label, *who, source=source, note=labelled.note
    )


def _of_activity(activity: SetActivity, who: tuple[int, str], source: Source) -> Decision:
    return Decision(
        activity.start,
        activity.end,
        None,
        activity.activity,
        *who,
        source=source,
        subclass=activity.subclass,
        note=activity.note,
    )
