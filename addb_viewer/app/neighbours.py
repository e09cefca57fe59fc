"""What a reviewer is told of others' edits: those that touch the same frames."""

from collections.abc import Iterator, Sequence

from annotations.events import (
    AcceptProposal,
    ClearRange,
    Edit,
    Event,
    FlagRange,
    RejectProposal,
    SetActivity,
)
from annotations.trial_review import TrialReview
from annotations.wording import said_by


def news(
    edits: Sequence[Edit], review: TrialReview, mine: str | None, chosen: tuple[int, int] | None
) -> Iterator[tuple[str, str]]:
    """Title and text of each note.

    Args:
        edits: new ones of this trial.
        review: with them.
        mine: name of the one who is told.
        chosen: the range that they have selected.
    """
    for edit in edits:
        if edit.author == mine:
            continue
        clashes = [c for c in review.conflicts_of(edit.number) if mine in (c.earlier.author, c.later.author)]
        if clashes:
            yield "You disagree", str(clashes[0])
        elif _touches(edit.event, review, mine, chosen):
            yield f"{edit.author}, in the same place", said_by(edit.event)


def _touches(event: Event, review: TrialReview, mine: str | None, chosen: tuple[int, int] | None) -> bool:
    """Whether an edit is about frames that this reviewer has selected or labelled."""
    start, end = _frames_of(event)
    own = [(f.start, f.end) for f in review.flags if f.author == mine]
    own += [(c.start, c.end) for c in review.cleared if c.author == mine]
    return any(a < end and start < b for a, b in (*([chosen] if chosen else []), *own))


def _frames_of(event: Event) -> tuple[int, int]:
    match event:
        case FlagRange(start, end) | ClearRange(start, end) | SetActivity(start, end):
            return start, end
        case AcceptProposal(proposal) | RejectProposal(proposal):
            return proposal.start, proposal.end
        case _:
            return 0, 0
