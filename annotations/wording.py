"""An edit as one line for people."""

from annotations.activities import activity_words
from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Edit,
    Event,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    Redo,
    RefuseActivity,
    RejectProposal,
    SetActivity,
    SetStatus,
    Undo,
)
from annotations.foot_names import foot_named
from annotations.reasons import reason_words

SURE = 0.995  # a share above it would round to 100 %, which nothing is


def sure_words(confidence: float) -> str:
    """A certainty from 0 to 1 in percent; never 100 %."""
    return "> 99 %" if confidence > SURE else f"{100 * confidence:.0f} %"


def said(edit: Edit) -> str:
    """Number, author and what the edit says."""
    return f"edit {edit.number} by {edit.author}: {said_by(edit.event)}"


def said_by(event: Event) -> str:
    """What an edit says, without who said it."""
    match event:
        case FlagRange(start, end, reason, foot):
            line = f"{_place(start, end, foot)}: the force does not count, {reason_words(reason)}"
        case ClearRange(start, end, foot):
            line = f"{_place(start, end, foot)}: the force counts"
        case AcceptProposal(proposal):
            line = f"{_proposed(proposal)} accepted"
        case RejectProposal(proposal):
            line = f"{_proposed(proposal)} rejected"
        case SetActivity(start, end, activity, subclass):
            line = f"frames {start} to {end - 1}: {activity_words(activity, subclass)}"
        case ClearActivity(start, end):
            line = f"frames {start} to {end - 1}: activity removed"
        case RefuseActivity(start, end, activity, subclass):
            named = activity_words(activity, subclass)
            line = f"frames {start} to {end - 1}: the suggestion {named} refused"
        case SetStatus(status, left_out=left_out, unusable=unusable):
            line = str(status) + (f", unusable for {unusable}" if unusable else "")
            line += f", {len(left_out)} undecided proposals stay left out" if left_out else ""
        case ImportLabels(missing):
            labelled = sum(end - start for start, end in missing)
            line = f"review.json imported, {labelled} frames without force"
        case ImportTable():
            labels = len(event.ranges) + len(event.activities)
            line = f"{event.file} imported by {event.by}, {labels} ranges"
        case Undo(number):
            line = f"edit {number} undone"
        case Redo(number):
            line = f"edit {number} counts again"
    note = getattr(event, "note", "")
    return f"{line} ({note})" if note else line


def _place(start: int, end: int, foot: str | None) -> str:
    return f"frames {start} to {end - 1}, {foot_named(foot)}"


def _proposed(proposal: Proposal) -> str:
    place = _place(proposal.start, proposal.end, proposal.foot)
    sure = sure_words(proposal.confidence)
    return f"{place}: the proposal '{reason_words(proposal.reason)}', {sure} sure,"
