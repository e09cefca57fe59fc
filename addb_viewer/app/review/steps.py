"""From one proposal or flagged range to another, and what is decided about them: N, P, Enter, Backspace."""

from typing import Protocol

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.trial_view.frame_ranges import Selection, Stop, next_stop, place_of, stops_of
from addb_viewer.trial_view.proposals import Pending, State
from annotations.errors import ReviewError
from annotations.events import AcceptProposal, Event, RejectProposal
from annotations.trial_review import TrialReview


class Review(Protocol):
    """The review of the trial on the screen, as far as steps need it."""

    screen: Screen
    notices: Notices
    proposals: tuple[Pending, ...]
    stop: Stop | None

    @property
    def review(self) -> TrialReview:
        """The present state."""

    @property
    def chosen(self) -> tuple[int, int] | None:
        """The selected range."""

    @property
    def current(self) -> Pending | None:
        """The proposal that Enter and Backspace are about."""

    def record(self, event: Event) -> None:
        """Record an edit."""

    def stop_at(self, stop: Stop | None, selection: Selection) -> None:
        """Select frames."""

    def drop(self) -> None:
        """Nothing is selected any more."""


class Steps:
    """Of one reviewer."""

    def __init__(self, review: Review) -> None:
        self._review, self._screen = review, review.screen

    def on(self) -> None:
        """N: the next open proposal or flagged range."""
        self._step(1)

    def back(self) -> None:
        """P: the previous one."""
        self._step(-1)

    def accept(self) -> None:
        """Enter."""
        self._decide(AcceptProposal)

    def reject(self) -> None:
        """Backspace."""
        self._decide(RejectProposal)

    def _step(self, direction: int) -> None:
        review = self._review
        stops = stops_of(review.proposals, review.review)
        here = review.stop if review.stop in stops else (self._screen.frame, -1, None)
        found = next_stop(stops, here, direction)
        if found is None:
            where = "after" if direction > 0 else "before"
            review.notices.tell(
                "That was all", f"No open proposal and no flagged range {where} this frame of the trial."
            )
            return
        self._show(found)

    def _decide(self, event: type[AcceptProposal] | type[RejectProposal]) -> None:
        review = self._review
        found = review.current
        if found is None:
            where = "here" if review.chosen is None else "on the selected frames"
            raise ReviewError(f"no open proposal {where}; N goes to the next")
        review.record(event(found.proposal))
        after = [place_of(p) for p in review.proposals if p.state is State.OPEN]
        onward = next_stop(after, place_of(found), 1)
        if after:
            self._show(onward or after[0])
            return
        review.drop()
        review.notices.tell("All proposals are decided", "T finishes the trial and goes to the next.")

    def _show(self, stop: Stop) -> None:
        """Select it, show the frame on which most of its force is missing, and play its frames."""
        start, end, foot = stop
        replay = self._screen.replay
        most = None if replay is None else replay.most_missing(start, end, foot)
        self._screen.playback.show_loop(start, end, start if most is None else most.frame)
        self._review.stop_at(stop, Selection(start, end))
