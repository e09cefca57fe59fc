"""Ranges of frames: the one that keys act on, and those that N and P lead to."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from addb_viewer.trial_view.proposals import Pending, State
from annotations.events import (
    IMPORTED,
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Event,
    FlagRange,
    RefuseActivity,
    RejectProposal,
    SetActivity,
)
from annotations.review_errors import ReviewError
from annotations.trial_review import FlaggedRange, TrialReview

Stop = tuple[int, int, str | None]  # start, end, foot


def stops_of(proposals: Sequence[Pending], review: TrialReview) -> list[Stop]:
    """Open proposals, disagreements and people's flags of a trial, in order."""
    stops = {place_of(p) for p in proposals if p.state is State.OPEN}
    stops |= {(flag.start, flag.end, flag.foot) for flag in review.flags if flag.author != IMPORTED}
    stops |= {(clash.start, clash.end, clash.foot) for clash in review.conflicts}
    return sorted(stops, key=order)


def next_stop(stops: Sequence[Stop], here: Stop, direction: int) -> Stop | None:
    """The next one after a place, or the last one before it; at the end, from the other end; None of none.

    Args:
        stops: in order.
        here: a stop, or any other place.
        direction: 1 or −1.
    """
    if direction > 0:
        return next((stop for stop in stops if order(stop) > order(here)), next(iter(stops), None))
    before = (stop for stop in reversed(stops) if order(stop) < order(here))
    return next(before, stops[-1] if stops else None)


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


def moved_border(
    flags: Sequence[FlaggedRange], place: Stop, to: tuple[int, int]
) -> list[FlagRange | ClearRange]:
    """What gives a flag another border: a longer one is flagged as a whole, what a shorter one leaves counts.

    Args:
        flags: of the trial.
        place: of the one.
        to: start and end that it has from now on.

    Raises:
        ReviewError: there is no such flag.
    """
    flag = next((f for f in flags if (f.start, f.end, f.foot) == place), None)
    if flag is None:
        raise ReviewError(f"there is no flag of frames {place[0]}–{place[1] - 1} any more")
    events: list[FlagRange | ClearRange] = []
    start, end = to
    if start < flag.start or end > flag.end:
        events.append(FlagRange(start, end, flag.reason, flag.foot, flag.note))
    left = ((flag.start, min(start, flag.end)), (max(end, flag.start), flag.end))
    return events + [ClearRange(a, b, flag.foot, "") for a, b in left if a < b]


def order(stop: Stop) -> tuple[int, int, str]:
    """By time, then by foot."""
    return stop[0], stop[1], stop[2] or ""


@dataclass(frozen=True)
class Selection:
    """Marks of a range; None where a border has not been set."""

    start: int | None = None
    end: int | None = None  # the first frame after it
    spent_at: int | None = None  # frame at which it was painted: it holds until the cursor moves on

    def with_start(self, frame: int) -> "Selection":
        """I: the range begins at a frame. An end before it becomes the start; of a whole range it goes."""
        end = self.end if self.spent_at is None else None
        if end is None or end > frame:
            return Selection(frame, end)
        return Selection(end - 1, frame + 1) if self.start is None else Selection(frame)

    def with_end(self, frame: int) -> "Selection":
        """O: the range ends with a frame. A start after it becomes the end; of a whole range it goes."""
        start = self.start if self.spent_at is None else None
        if start is None or start <= frame:
            return Selection(start, frame + 1)
        return Selection(frame, start + 1) if self.end is None else Selection(None, frame + 1)

    @property
    def is_whole(self) -> bool:
        """Whether both borders are set."""
        return self.start is not None and self.end is not None

    def spent(self, frame: int) -> "Selection":
        """After it was painted at a frame: another key may still repaint it there."""
        return replace(self, spent_at=frame)

    def seen_from(self, frame: int) -> "Selection":
        """What is left of it when the cursor is at a frame."""
        return Selection() if self.spent_at is not None and self.spent_at != frame else self

    def frames(self, cursor: int, frames: int) -> tuple[int, int] | None:
        """The range, an open one up to the cursor; None where nothing is selected.

        Args:
            cursor: the present frame.
            frames: of the trial.
        """
        if self.start is None and self.end is None:
            return None
        start = min(self.start, cursor) if self.start is not None and self.end is None else self.start
        end = self.end if self.end is not None else max(self.start or 0, cursor) + 1
        first = (min(cursor, end - 1) if cursor < end else end - 1) if start is None else start
        return max(first, 0), min(end, frames)
