"""What one reviewer is told about the others' edits: who overruled whom, and who is at the same frames."""

from collections.abc import Sequence

from annotations.decisions import Decision, activity_decisions, force_decisions
from annotations.events import IMPORTED, Edit
from annotations.trial_review import Conflict, TrialReview
from annotations.wording import said


def notes_for(reader: str, edits: Sequence[Edit], review: TrialReview) -> tuple[str, ...]:
    """What a reviewer should know about new edits of a trial, the reviewer's own among them.

    There is a note for every conflict that one of these edits brought up between the reader and somebody
    else, and for every other edit by somebody else at frames that the reader has just edited as well.

    Args:
        reader: who is told.
        edits: what has been recorded since the reader looked last, of this trial.
        review: the trial's present state.
    """
    new = {edit.number for edit in edits}
    conflicts = [c for c in review.conflicts if _is_between(reader, c) and new & _edits_of(c)]
    told = {number for conflict in conflicts for number in _edits_of(conflict)}
    own = [edit for edit in edits if edit.author == reader]
    beside = [
        edit
        for edit in edits
        if edit.author not in (reader, IMPORTED)
        and edit.number not in told
        and any(_touch(edit, other) for other in own)
    ]
    return (
        *(str(conflict) for conflict in conflicts),
        *(f"at the same frames as you: {said(edit)}" for edit in beside),
    )


def _is_between(reader: str, conflict: Conflict) -> bool:
    return reader in (conflict.earlier.author, conflict.later.author)


def _edits_of(conflict: Conflict) -> set[int]:
    return {conflict.earlier.edit, conflict.later.edit}


def _touch(one: Edit, other: Edit) -> bool:
    """Whether two edits speak of the same frames, of the same foot, about forces or about activities."""
    return any(
        _overlap(a, b)
        for decisions in (force_decisions, activity_decisions)
        for a in decisions(one)
        for b in decisions(other)
    )


def _overlap(a: Decision, b: Decision) -> bool:
    same_foot = a.foot is None or b.foot is None or a.foot == b.foot
    return same_foot and a.start < b.end and b.start < a.end
