"""T: a trial is finished, after a question where something speaks against it, and the next one opened."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from addb_viewer.app.page.screen import Screen
from addb_viewer.app.queue.controller import QueueController
from addb_viewer.app.review.controller import ReviewController
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.app.trial.disagreements import conflict_words
from addb_viewer.app.trial.foot_names import foot_words
from addb_viewer.app.trial.frame_ranges import Stop
from addb_viewer.app.trial.proposals import undecided_frames, unsure_proposals
from annotations.events import Proposal, Status
from annotations.trial_review import TrialReview

MOST = 3  # disagreements in words; the others are counted


@dataclass(frozen=True)
class _Finished:
    """What the last T did."""

    subject: str
    trial: str
    led_to: TrialPlace
    edits: int  # recorded here by then


class Finishing:
    """Finishes trials at one browser."""

    def __init__(self, screen: Screen, review: ReviewController, queue: QueueController) -> None:
        self.screen, self.review, self.queue = screen, review, queue
        self._last: _Finished | None = None

    def finish(self) -> None:
        """T."""
        screen = self.screen
        author, shared, solve = screen.reviewer.author(), screen.shared, screen.shared.fits.new
        reasons, title = self._doubts(), "Finish this trial all the same?"
        if solve is not None:
            whose = "" if solve.by == author else f" that {solve.by} asked for"
            waits = f"A new solve{whose} waits: keep it or discard it."
            screen.questions.ask(
                title,
                [waits, *reasons],
                "Keep it and finish",
                lambda: self._finish(lambda: shared.keep(author)),
                also=(
                    "Discard it and finish",
                    lambda: self._finish(lambda: shared.discard(author, solve.number)),
                ),
            )
        elif reasons:
            screen.questions.ask(title, reasons, "Finish", self._finish)
        else:
            self._finish()

    def undo(self) -> None:
        """U: right after T, the finishing, in the trial that it is about; else the last edit of this one."""
        last, self._last = self._last, None
        if last is not None and (last.led_to, last.edits) == (self.queue.here, self.review.recorded):
            self.screen.open(last.subject, last.trial)
        self.review.undo()

    def _doubts(self) -> list[str]:
        """Why to ask before the trial is finished, a sentence or two each."""
        replay, review = self.screen.replay, self.review.review
        reasons = [*disagreements(review), *(f"Of this trial, {row}." for row in review.unreadable)]
        if replay is not None and replay.bodies is None:
            reasons.append("Nothing has been fitted to this trial yet: G fits it.")
        if self._is_untouched():
            reasons.append("T has just brought you here, and you have not looked at it.")
        if replay is None:
            return reasons
        unsure = unsure_proposals(self.review.proposals, review, replay.frames, replay.forces.confidence)
        return [
            *reasons,
            *undecided(undecided_frames(self.review.left_out or (), review, replay.frames), unsure),
        ]

    def _is_untouched(self) -> bool:
        """Whether nothing was done in the trial that the last T led to."""
        last, screen = self._last, self.screen
        if last is None or last.led_to != self.queue.here or screen.playing:
            return False
        return screen.frame == 0 and self.review.recorded == last.edits

    def _finish(self, first: Callable[[], None] | None = None) -> None:
        screen, trials = self.screen, self.queue.trials
        if first is not None:
            first()
        here = self.queue.here
        self.review.set_status(Status.FINISHED)
        trials.refresh(screen.shared.name)
        row = self.queue.offer()
        if row is None:
            self._last = _Finished(*here, here, self.review.recorded)
            self.queue.draw()
            self._tell_end()
            return
        self._last = _Finished(*here, (row.subject, row.trial), self.review.recorded)
        name = f"{row.subject} {row.trial}" if trials.subjects.several else row.trial
        if row.figures is None:
            unfitted = f"Next: {name}. Nothing has been fitted to it: G fits it."
            screen.notices.tell("Finished", unfitted, "yellow")
        else:
            screen.notices.tell("Finished", f"Next: {name}. U takes the finishing back.")
        try:
            screen.open(row.subject, row.trial)
        except Exception:
            trials.people.go(screen.page, here)
            raise

    def _tell_end(self) -> None:
        taken, outside, tell = self.queue.taken(), self.queue.outside(), self.screen.notices.tell
        if taken:
            tell("Nothing is left for you", f"Somebody is on what still waits: {'; '.join(taken)}.")
        elif outside:
            trials = "trial waits" if outside == 1 else "trials wait"
            tell("Finished", f"Nothing else waits in the queue's filter; {outside} {trials} outside of it.")
        else:
            tell("All finished", "Every trial of the queue has been reviewed.")


def undecided(left_out: Sequence[Stop], unsure: Sequence[Proposal]) -> list[str]:
    """What finishing means for what nobody has decided about.

    Args:
        left_out: frames that detection is sure of.
        unsure: the other proposals.
    """
    told = []
    if left_out:
        frames = "; ".join(f"{start}–{end - 1} {foot_words(foot)}" for start, end, foot in left_out[:MOST])
        more = f", and {len(left_out) - MOST} more" if len(left_out) > MOST else ""
        told.append(f"Nobody has decided about what detection leaves out: {frames}{more}. It stays left out.")
    if unsure:
        told.append(f"Open proposals of which detection is not sure: {len(unsure)}. Their forces count.")
    return told


def disagreements(review: TrialReview) -> list[str]:
    """Where two people say different things, the first few in words.

    Args:
        review: of the trial.
    """
    told = [f"Two people disagree about {conflict_words(conflict)}." for conflict in review.conflicts[:MOST]]
    more = len(review.conflicts) - MOST
    return [*told, f"They disagree {more} times more."] if more > 0 else told
