"""What reviewers are told of each other's edits: disagreements, and those that touch the same frames."""

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
from annotations.foot_names import foot_words
from annotations.reasons import FORCE_COUNTS, reason_words
from annotations.trial_review import Conflict, Opinion, TrialReview
from annotations.wording import said_by


def news(
    edits: Sequence[Edit], review: TrialReview, mine: str | None, chosen: tuple[int, int] | None
) -> Iterator[tuple[str, str]]:
    """Title and text of each note.

    Args:
        edits: new ones of this trial.
        review: with them.
        mine: name of the one who is told; of a disagreement everybody hears by `disagreements`.
        chosen: the range that they have selected.
    """
    for edit in edits:
        if edit.author == mine:
            continue
        clashes = [c for c in review.conflicts_of(edit.number) if mine in (c.earlier.author, c.later.author)]
        if not clashes and _touches(edit.event, review, mine, chosen):
            yield f"{edit.author}, in the same place", said_by(edit.event)


def disagreements(before: TrialReview, now: TrialReview) -> Iterator[tuple[str, str, str]]:
    """Name, title and text of each note: everybody hears of a disagreement that they have a part in, once.

    Args:
        before: the state of a trial's review.
        now: the state after some edits.
    """
    known = {(c.earlier.edit, c.later.edit) for c in before.conflicts}
    new: dict[tuple[str, ...], list[Conflict]] = {}
    for conflict in now.conflicts:
        if (conflict.earlier.edit, conflict.later.edit) not in known:
            pair = tuple(sorted((conflict.earlier.author, conflict.later.author)))
            new.setdefault(pair, []).append(conflict)
    for pair, conflicts in new.items():
        more = f"; and {len(conflicts) - 1} more ranges" if len(conflicts) > 1 else ""
        for name in pair:
            (other,) = set(pair) - {name}
            yield name, f"You and {other} disagree", f"{now.trial}, {conflict_words(conflicts[0])}{more}"


def conflict_words(conflict: Conflict) -> str:
    """Who says what about which frames, in the words of the keys."""
    of_foot = f", {foot_words(conflict.foot)}" if conflict.foot else ""
    said = ", ".join(f"{o.author} says '{_label_words(o)}'" for o in (conflict.earlier, conflict.later))
    return (
        f"frames {conflict.start} to {conflict.end - 1}{of_foot}: {said}; "
        f"the later one, {conflict.later.author}'s, counts"
    )


def _label_words(opinion: Opinion) -> str:
    return "the force counts" if opinion.label == FORCE_COUNTS else reason_words(opinion.label)


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
