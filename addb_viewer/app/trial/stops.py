"""Where N and P lead: open proposals and flagged ranges, in the order of time."""

from collections.abc import Sequence

from addb_viewer.app.trial.proposals import Pending, State
from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Event,
    FlagRange,
    RefuseActivity,
    RejectProposal,
    SetActivity,
)
from annotations.trial_review import TrialReview

Stop = tuple[int, int, str | None]  # start, end, foot


def stops_of(proposals: Sequence[Pending], review: TrialReview) -> list[Stop]:
    """All of a trial, in order."""
    stops = {place_of(p) for p in proposals if p.state is State.OPEN}
    stops |= {(flag.start, flag.end, flag.foot) for flag in review.flags}
    return sorted(stops, key=order)


def next_stop(stops: Sequence[Stop], here: Stop, direction: int) -> Stop | None:
    """The next one after a place, or the last one before it; None where there is none.

    Args:
        stops: in order.
        here: a stop, or any other place.
        direction: 1 or −1.
    """
    if direction > 0:
        return next((stop for stop in stops if order(stop) > order(here)), None)
    return next((stop for stop in reversed(stops) if order(stop) < order(here)), None)


def place_of(pending: Pending) -> Stop:
    """Where a proposal is."""
    return pending.proposal.start, pending.proposal.end, pending.proposal.foot


def place_said(event: Event) -> Stop | None:
    """Where an edit is about; None where it is about no frames."""
    match event:
        case FlagRange(start, end, foot=foot) | ClearRange(start, end, foot=foot):
            return start, end, foot
        case AcceptProposal(p) | RejectProposal(p):
            return p.start, p.end, p.foot
        case SetActivity(start, end) | ClearActivity(start, end) | RefuseActivity(start, end):
            return start, end, None
        case _:
            return None


def order(stop: Stop) -> tuple[int, int, str]:
    """By time, then by foot."""
    return stop[0], stop[1], stop[2] or ""
