"""The queue at one browser: all trials, worst first; and T, which finishes one and opens the next."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from addb_viewer.app.page.screen import Screen
from addb_viewer.app.queue.queue_html import end_html, rows_html
from addb_viewer.app.queue.queue_rows import Row, next_trial, to_review
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.review.review_controller import ReviewController
from addb_viewer.app.solve.solve_controller import SolveController
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.text.amounts import counted
from addb_viewer.trial_view.disagreements import conflict_words
from addb_viewer.trial_view.frame_ranges import Stop
from addb_viewer.trial_view.proposals import State, undecided_frames, unsure_proposals
from addb_viewer.trial_view.trial_verdict import USES, reason_words
from addb_viewer.trial_view.worst_frame import beyond
from annotations.events import AcceptProposal, Proposal, SetStatus, Status, Unusable
from annotations.foot_names import foot_words
from annotations.review_errors import ReviewError
from annotations.trial_review import TrialReview
from annotations.wording import sure_words
from solver.common.errors import SolverError
from solver.fitting.verdict import Use, Why

MOST_TAKEN = 5  # in words; the others are counted
MOST = 200  # rows in the list; the queue's page has the others
NOT_ASKED = (Why.NO_FORCES, Why.PERSON)  # the recording itself, or a person's own word


class Judging(Screen, Protocol):
    """A session, as far as finishing a trial asks it."""

    solving: SolveController

    def diagnose(self) -> None:
        """X."""


class QueueController:
    """Which trial is next."""

    def __init__(self, trials: TrialQueue, screen: Screen) -> None:
        self.trials, self.screen = trials, screen
        self._rows: list[Row] = []

    def choose(self) -> None:
        """C: the trials with their verdicts; a click opens one."""
        rows = self.let_through()
        self._rows = rows[:MOST]
        done, trials = sum(row.finished for row in rows), [row for row in rows if not row.error]
        how = "as the queue's page shows them" if self._paged else "worst first"
        table = rows_html(
            self._rows,
            self.here,
            notes=self.trials.subjects.root.notes,
            people=self.trials.people.others(self.screen.page),
            at_work=self.trials.at_work(),
        )
        self.screen.questions.show(f"{done} of {len(trials)} trials are finished; {how}", table)

    def fit_unfitted(self) -> None:
        """Fit all subjects without a fit.

        Raises:
            SolverError: there is none.
        """
        names = self.trials.unfitted()
        if not names:
            raise SolverError("every subject has a fit already")
        self.trials.fit_all.start(names, self.screen.reviewer.name)

    def open_row(self, index: int) -> None:
        """Open a row that was clicked.

        Raises:
            SolverError: there is no such row, or its subject cannot be read.
        """
        if index >= len(self._rows):
            raise SolverError("the queue has changed; choose again")
        row = self._rows[index]
        if row.error:
            raise SolverError(row.error)
        self.screen.open(row.subject, row.trial)

    @property
    def here(self) -> TrialPlace:
        """Subject and trial on the screen."""
        replay = self.screen.replay
        return self.screen.shared.name, replay.name if replay else ""

    def offer(self) -> Row | None:
        """The trial to go on with by filter and order, offered to nobody else and nobody else's; or None."""
        rows, here = self._for_me(), self.here
        return self.trials.people.offer(self.screen.page, lambda taken: next_trial(rows, here, taken))

    def fit_ahead(self) -> None:
        """Have the next unfitted trials fitted in the background, while this one is reviewed."""
        waiting = to_review(self.let_through(), self.here)
        subjects = dict.fromkeys(row.subject for row in waiting if row.figures is None)
        self.trials.fit_ahead(list(subjects), self.screen.reviewer.name)

    def read_ahead(self) -> None:
        """Have the trial that would be next read in the background, while this one is reviewed."""
        row = next_trial(self._for_me(), self.here, self.trials.people.others(self.screen.page))
        if row is not None and row.figures is not None:
            self.trials.subjects.read_ahead(row.subject, row.trial)

    @property
    def _paged(self) -> bool:
        """Whether the queue's page is open in this browser."""
        return self.screen.reviewer.browser in self.trials.orders

    def outside(self) -> int:
        """How many trials wait for a person that the queue's page does not show."""
        waiting = len(to_review(self.trials.rows(), self.here))
        return waiting - len(to_review(self.let_through(), self.here))

    def let_through(self) -> list[Row]:
        """The rows that the queue's page of this browser shows, as long as it is open; else all."""
        rows, places = self.trials.rows(), self.trials.orders.get(self.screen.reviewer.browser)
        if places is None:
            return rows
        by_place = {(row.subject, row.trial): row for row in rows}
        return [by_place[place] for place in places if place in by_place]

    def taken(self) -> list[str]:
        """In words, who is on the trials that wait, or is to review them."""
        people = self.trials.people.others(self.screen.page)
        waiting = to_review(self.let_through(), self.here)
        told = []
        for row in waiting:
            if (row.subject, row.trial) in people:
                told.append(f"{', '.join(people[row.subject, row.trial])} on {row.trial}")
            elif self._left_to(row):
                told.append(f"{row.trial} is for {self._left_to(row)}")
        more = len(told) - MOST_TAKEN
        return [*told[:MOST_TAKEN], f"{more} more"] if more > 0 else told

    def _for_me(self) -> list[Row]:
        return [row for row in self.let_through() if not self._left_to(row)]

    def _left_to(self, row: Row) -> str:
        return row.left_to(self.screen.reviewer.name, self.trials.people.names, time.time())


FEW = 3  # disagreements in words; the others are counted
READ_S = 0.5  # within which a second T is a key that was hit twice: nobody has read what the first one asked
SEEN_S = 2.0  # before that nobody has looked at a trial that T has just brought


@dataclass(frozen=True)
class _Finished:
    """What the last T did."""

    subject: str
    trial: str
    led_to: TrialPlace
    edits: int  # recorded here by then


class Finishing:
    """Finishes trials at one browser."""

    def __init__(
        self,
        screen: Judging,
        review: ReviewController,
        queue: QueueController,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.screen, self.review, self.queue, self._clock = screen, review, queue, clock
        self._last: _Finished | None = None
        self._came_at = -math.inf  # when the last T brought the trial

    def finish(self) -> None:
        """T."""
        self.screen.reviewer.author()
        self._ask("finish", self._doubts(self._open()), self._finish)

    def finish_sure(self) -> None:
        """Shift T: the proposals of which detection is sure are accepted, then as T."""
        author, sure = self.screen.reviewer.author(), self._sure()
        count = counted(len(sure), "proposal")
        first = [f"Accepts {count} of at least {sure_words(self._least)}."] if sure else []

        def accept_and_finish() -> None:
            shared, trial = self.screen.shared, self.queue.here[1]
            for proposal in sure:
                shared.reviews.record(trial, AcceptProposal(proposal), author)
                self.review.recorded += 1
            self._finish(f"Accepted {count} of at least {sure_words(self._least)}." if sure else "")

        doubts = self._doubts(self._unsure())
        self._ask("finish_sure", [*doubts, *first] if doubts else [], accept_and_finish)

    def mark_unusable(self) -> None:
        """B: the trial is finished, and kept out of releases; for what and why is asked."""
        self.screen.reviewer.author()
        trial, decides = self.queue.here[1], self.screen.verdict.verdict.decides
        why = reason_words(decides) if decides is not None and self.screen.verdict.verdict.reasons else ""

        def marked(unusable: Unusable, reason: str) -> None:
            if not reason.strip():
                raise ReviewError("write why")
            self._finish(
                f"{trial} is unusable for {unusable}.",
                SetStatus(Status.FINISHED, reason.strip(), unusable=unusable),
            )

        answers = {f"For {unusable}": partial(marked, unusable) for unusable in Unusable}
        self.screen.questions.ask_text(f"{trial} is not usable", "Why", why, answers)

    def _ask(self, key: str, reasons: Sequence[str], then: Callable[[], None]) -> None:
        """Do it where nothing speaks against it; else one question says what does.

        Args:
            key: the action whose key asks, and answers.
            reasons: what speaks against it.
            then: what is done.
        """
        if not reasons:
            then()
            return
        asked_at = self._clock()

        def once_read() -> None:
            if self._clock() - asked_at >= READ_S:
                then()
            else:
                self._ask(key, reasons, then)

        options = [
            (key, "Finish all the same", once_read),
            ("diagnose", "Look for the cause", self.screen.diagnose),
            ("unusable", "Mark it unusable", self.mark_unusable),
        ]
        self.screen.questions.decide(f"Finish {self.queue.here[1]}?", reasons, options)

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

    def look(self) -> None:
        """Whoever presses another key than T has looked at the trial that T brought."""
        self._came_at = -math.inf

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
        if self._clock() - self._came_at < SEEN_S and self._last and self._last.led_to == self.queue.here:
            reasons.append("T has just brought you here, and you have not looked at it.")
        return [*reasons, *self._against(), *undecided]

    def _against(self) -> list[str]:
        """What the trial's verdict has against it."""
        verdict, replay = self.screen.verdict.verdict, self.screen.replay
        if replay is None or verdict.use is Use.UNKNOWN:
            return []
        told = [reason_words(reason) for reason in verdict.reasons if reason.why not in NOT_ASKED]
        over = 0 if replay.residual is None else int(beyond(replay.residual).sum())
        frames = f", on {counted(over, 'frame')}" if over else ""
        return [f"{USES[verdict.use]}: {', '.join(told)}{frames}."] if told else []

    def _waiting_solve(self) -> list[str]:
        solve = self.screen.shared.fits.new
        if solve is None:
            return []
        if solve.by != self.screen.reviewer.name:
            return [f"A new solve that {solve.by} asked for waits: it goes on waiting for {solve.by}."]
        worse = self.screen.solving.worse
        if worse:
            return [f"Your new solve is worse ({', '.join(worse)}): it is discarded. Shift+Enter keeps it."]
        figures = residuals_words(self.screen)
        return [f"Your new solve waits{figures}: it is kept. Shift+Backspace discards it."]

    def _finish(self, done: str = "", status: SetStatus | None = None) -> None:
        """Do it; what is undecided takes its default.

        Args:
            done: what has been done to the trial just now, in words.
            status: what is said of it; None: that it is finished.
        """
        screen, trials, solve = self.screen, self.queue.trials, self.screen.shared.fits.new
        if solve is not None and solve.by == screen.reviewer.name:
            if screen.solving.worse:
                screen.shared.discard(screen.reviewer.name)
            else:
                screen.shared.keep(screen.reviewer.name)
        here = self.queue.here
        self.review.set_status(Status.FINISHED, status)
        trials.refresh(screen.shared.name)
        row = self.queue.offer()
        self.queue.fit_ahead()
        if row is None:
            self._last = _Finished(*here, here, self.review.recorded)
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
        self._came_at = self._clock()
        self.queue.read_ahead()

    def _tell_end(self) -> None:
        taken, outside = self.queue.taken(), self.queue.outside()
        if taken:
            title, what = "Nothing is left for you", f"Somebody is on what still waits: {'; '.join(taken)}."
        elif outside:
            waits = "trial waits" if outside == 1 else "trials wait"
            title, what = "Finished", f"Nothing else waits on the queue's page; {outside} {waits} beside it."
        else:
            title, what = "All finished", "Every trial has been reviewed."
        self.screen.questions.show(title, end_html(what, self.queue.trials.rows()))


def undecided(left_out: Sequence[Stop], unsure: Sequence[Proposal]) -> list[str]:
    """What finishing means for what nobody has decided about.

    Args:
        left_out: frames that detection is sure of.
        unsure: the other proposals.
    """
    told = []
    if left_out:
        frames = "; ".join(f"{start}–{end - 1} {foot_words(foot)}" for start, end, foot in left_out[:FEW])
        more = f", and {len(left_out) - FEW} more" if len(left_out) > FEW else ""
        told.append(f"Nobody has decided about what detection leaves out: {frames}{more}. It stays left out.")
    if unsure:
        told.append(f"Open proposals of which detection is not sure: {len(unsure)}. Their forces count.")
    return told


def disagreements(review: TrialReview) -> list[str]:
    """Where two people say different things, the first few in words.

    Args:
        review: of the trial.
    """
    told = [f"Two people disagree about {conflict_words(conflict)}." for conflict in review.conflicts[:FEW]]
    more = len(review.conflicts) - FEW
    return [*told, f"They disagree {more} times more."] if more > 0 else told


def residuals_words(screen: Screen) -> str:
    """Residual force of the trial in the kept fit and in the new solve; empty where one is not known."""
    fits, trial = screen.shared.fits, screen.replay.name if screen.replay else ""
    libraries = (fits.compared, fits.shown)
    figures = (None if library is None else library.figures(trial) for library in libraries)
    before, now = (each and each.linear_residual for each in figures)
    if before is None or now is None:
        return ""
    return f" ({before.rms_N:.1f} → {now.rms_N:.1f} N of residual force)"
