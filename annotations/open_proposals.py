"""Which of a detector's proposals still wait for a person; it never changes what a person has said."""

from collections.abc import Sequence

from annotations.events import Proposal
from annotations.trial_review import TrialReview

SAME = 0.5  # of two ranges' frames in common, from which on they are one finding placed a little differently


def open_proposals(proposals: Sequence[Proposal], review: TrialReview) -> tuple[Proposal, ...]:
    """The proposals that are not settled: all frames decided, or flagged by a file, or the same one accepted.

    A detector that runs again after an edit places its findings a few frames off; what was accepted is not
    asked again. What was rejected is: its new frames would be left out, and nobody has said so.

    Args:
        proposals: a detector's, of one trial.
        review: of the same trial.
    """
    settled = review.judged(max((proposal.end for proposal in proposals), default=0))
    for flag in review.flags:
        settled[flag.start : flag.end, review.lane(flag.foot)] = True

    def is_open(proposal: Proposal) -> bool:
        return not (
            settled[proposal.start : proposal.end, review.lane(proposal.foot)].all()
            or any(_same(proposal, other) for other in review.accepted)
        )

    return tuple(proposal for proposal in proposals if is_open(proposal))


def _same(one: Proposal, other: Proposal) -> bool:
    common = min(one.end, other.end) - max(one.start, other.start)
    either = max(one.end, other.end) - min(one.start, other.start)
    return one.foot == other.foot and common >= SAME * either
