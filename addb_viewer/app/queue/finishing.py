"""T: a trial is finished and the next one opened; where something speaks against it, T says so first."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from addb_viewer.app.page.notices import IMPORTANT_S
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.queue.controller import QueueController
from addb_viewer.app.review.controller import ReviewController
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.text.amounts import counted
from addb_viewer.trial_view.disagreements import conflict_words
from addb_viewer.trial_view.frame_ranges import Stop
from addb_viewer.trial_view.proposals import State, undecided_frames, unsure_proposals
from annotations.events import AcceptProposal, Proposal, Status
from annotations.foot_names import foot_words
from annotations.trial_review import TrialReview
from annotations.wording import sure_words

MOST = 3  # disagreements in words; the others are counted
READ_S = 0.5  # within which a second T is a key that was hit twice: nobody has read what the first one said
T, SHIFT_T = "T", "Shift+T"


@dataclass(frozen=True)
class _Finished:
    """What the last T did."""

    subject: str
    trial: str
    led_to: TrialPlace
    edits: int  # recorded here by then


@dataclass(frozen=True)
class _Told:
    """What a first T said; the same key again decides."""

    key: str
    place: TrialPlace
    reasons: tuple[str, ...]


class Finishing:
    """Finishes trials at one browser."""

    def __init__(
        self,
        screen: Screen,
        review: ReviewController,
        queue: QueueController,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.screen, self.review, self.queue, self._clock = screen, review, queue, clock
        self._last: _Finished | None = None
        self._told: _Told | None = None
        self._told_at = 0.0

    def finish(self) -> None:
        """T."""
        self.screen.reviewer.author()
        if self._may_go_on(T, self._doubts(self._open())):
            self._finish()

    def finish_sure(self) -> None:
        """Shift T: the proposals of which detection is sure are accepted, then as T."""
        author, sure = self.screen.reviewer.author(), self._sure()
        count = counted(len(sure), "proposal")
        first = f"Accepts {count} of at least {sure_words(self._least)}." if sure else ""
        if not self._may_go_on(SHIFT_T, self._doubts(self._unsure()), first):
            return
        shared, trial = self.screen.shared, self.queue.here[1]
        for proposal in sure:
            shared.reviews.record(trial, AcceptProposal(proposal), author)
            self.review.recorded += 1
        self._finish(first.replace("Accepts", "Accepted"))

    def forget(self) -> None:
        """Esc: what T said is done with; T says it again."""
        self._told = None

    def _may_go_on(self, key: str, reasons: Sequence[str], first: str = "") -> bool:
        """Whether nothing speaks against it, or the same key has said what does; else it is said now."""
        told, now = _Told(key, self.queue.here, tuple(reasons)), self._clock()
        age = now - self._told_at
        if not reasons or (told == self._told and READ_S <= age <= IMPORTANT_S):
            self._told = None
            return True
        if told != self._told or age > READ_S:
            self._told, self._told_at = told, now
            words = " ".join(filter(None, (*reasons, first)))
            self.screen.notices.tell(f"{key} again finishes this trial", words, important=True)
        return False

    @property
    def _least(self) -> float:
        """From which certainty on a proposal is sure: the one from which on the fit leaves its forces out."""
        replay = self.screen.replay
        return 1.0 if replay is None else replay.forces.confidence

    def _sure(self) -> list[Proposal]:
        waiting = [p.proposal for p in self.review.proposals if p.state is State.OPEN]
        return [p for p in waiting if p.confidence >= self._least]

    def _open(self) -> list[str]:
        """What finishing means for proposals that nobody has decided."""
        replay = self.screen.replay
        if replay is None:
            return []
        left_out = undecided_frames(self.review.left_out or (), self.review.review, replay.frames)
        return [*undecided(left_out, ()), *self._unsure()]

    def _unsure(self) -> list[str]:
        replay, review = self.screen.replay, self.review.review
        if replay is None:
            return []
        return undecided((), unsure_proposals(self.review.proposals, review, replay.frames, self._least))

    def undo(self) -> None:
        """U: right after T, the finishing, in the trial that it is about; else the last edit of this one."""
        last, self._last = self._last, None
        if last is not None and (last.led_to, last.edits) == (self.queue.here, self.review.recorded):
            self.screen.open(last.subject, last.trial)
        self.review.undo()

    def _doubts(self, undecided: Sequence[str]) -> list[str]:
        """Why to say something before the trial is finished, a sentence or two each.

        Args:
            undecided: about proposals.
        """
        replay, review = self.screen.replay, self.review.review
        reasons = [*self._waiting_solve(), *disagreements(review)]
        reasons += [f"Of this trial, {row}." for row in review.unreadable]
        if replay is not None and replay.bodies is None:
            reasons.append("Nothing has been fitted to this trial yet: G fits it.")
        if self._is_untouched():
            reasons.append("T has just brought you here, and you have not looked at it.")
        return [*reasons, *undecided]

    def _waiting_solve(self) -> list[str]:
        solve = self.screen.shared.fits.new
        if solve is None:
            return []
        if solve.by != self.screen.reviewer.name:
            return [f"A new solve that {solve.by} asked for waits: it goes on waiting for {solve.by}."]
        figures = residuals_words(self.screen)
        return [f"Your new solve waits{figures}: it is kept. Shift+Backspace discards it."]

    def _is_untouched(self) -> bool:
        """Whether nothing was done in the trial that the last T led to."""
        last, screen = self._last, self.screen
        if last is None or last.led_to != self.queue.here or screen.playing:
            return False
        return screen.frame == 0 and self.review.recorded == last.edits

    def _finish(self, done: str = "") -> None:
        """Do it; what is undecided takes its default.

        Args:
            done: what has been done to the trial just now, in words.
        """
        screen, trials, solve = self.screen, self.queue.trials, self.screen.shared.fits.new
        if solve is not None and solve.by == screen.reviewer.name:
            screen.shared.keep(screen.reviewer.name)
        here = self.queue.here
        self.review.set_status(Status.FINISHED)
        trials.refresh(screen.shared.name)
        row = self.queue.offer()
        self.queue.fit_ahead()
        if row is None:
            self._last = _Finished(*here, here, self.review.recorded)
            self.queue.draw()
            self._tell_end()
            return
        self._last = _Finished(*here, (row.subject, row.trial), self.review.recorded)
        name = f"{row.subject} {row.trial}" if trials.subjects.several else row.trial
        if row.figures is None:
            fits = "It is being fitted." if trials.is_being_fitted(row.subject) else "G fits it."
            unfitted = f"{done} Next: {name}. Nothing is fitted to it yet. {fits}".strip()
            screen.notices.tell("Finished", unfitted, important=True)
        else:
            screen.notices.tell("Finished", f"{done} Next: {name}. U takes the finishing back.".strip())
        try:
            screen.open(row.subject, row.trial)
        except Exception:
            trials.people.go(screen.page, here)
            raise
        self.queue.read_ahead()

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


def residuals_words(screen: Screen) -> str:
    """Residual force of the trial in the kept fit and in the new solve; empty where one is not known."""
    fits, trial = screen.shared.fits, screen.replay.name if screen.replay else ""
    libraries = (fits.compared, fits.shown)
    figures = [
        library.figures(trial).get("linear_residual") or {} if library else {} for library in libraries
    ]
    before, now = (each.get("rms_N") for each in figures)
    if before is None or now is None:
        return ""
    return f" ({before:.1f} → {now:.1f} N of residual force)"
