"""The Queue panel of one browser: all trials, worst first; and T, which finishes one and opens the next."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import viser

from addb_viewer.app.page.notices import IMPORTANT_S, Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.queue.queue_html import fitting_html, rows_html
from addb_viewer.app.queue.queue_rows import Filter, Row, next_trial, shown, to_review
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.review.review_controller import ReviewController
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.text.amounts import counted
from addb_viewer.trial_view.disagreements import conflict_words
from addb_viewer.trial_view.frame_ranges import Stop
from addb_viewer.trial_view.html_pieces import boxed
from addb_viewer.trial_view.proposals import State, undecided_frames, unsure_proposals
from annotations.events import AcceptProposal, Proposal, Status
from annotations.foot_names import foot_words
from annotations.trial_review import TrialReview
from annotations.wording import sure_words
from solver.common.errors import SolverError

MOST_TAKEN = 5  # in words; the others are counted
MOST = 200  # rows on the page; the filter finds the others
PAGE_LINK = (
    "<a href='/queue' target='addb-viewer-queue'><b>The queue as a page</b></a>: filters, many at once"
)


class QueueController:
    """Which trial is next."""

    def __init__(
        self, gui: viser.GuiApi, tab: viser.GuiTabHandle, trials: TrialQueue, screen: Screen, notices: Notices
    ) -> None:
        self.trials, self.screen, self.notices = trials, screen, notices
        self._rows: list[Row] = []
        with tab:
            gui.add_html(boxed(PAGE_LINK))
            self.count = gui.add_html("")
            self.fit_all = gui.add_button(
                "Fit all that have no fit",
                hint="One subject at a time, after what people ask for; you can go on meanwhile",
                visible=False,
            )
            self.fitting = gui.add_html("", visible=False)
            self.cancel = gui.add_button(
                "Cancel the fits",
                color="gray",
                hint="The fit at work is dropped; those that have come stay",
                visible=False,
            )
            self.which = gui.add_dropdown("Show", tuple(Filter), initial_value=Filter.ALL)
            self.words = gui.add_text("Filter", "", hint="Part of a subject's or a trial's name")
            self.table = gui.add_html("")
            self.again = gui.add_button(
                "Read anew", color="gray", hint="New subjects, fits of other programs"
            )
        for handle in (self.which, self.words):
            handle.on_update(notices.in_order("Filtering", self.draw))
        self.fit_all.on_click(notices.in_order("Fitting all", self.fit_unfitted))
        self.cancel.on_click(notices.in_order("Cancelling", trials.cancel_fits))
        self.again.on_click(notices.in_order("Reading the queue", lambda: self.show(anew=True)))

    def show(self, *, anew: bool = False) -> None:
        """Read the queue, from memory unless it is to be read anew, and draw it."""
        self.trials.rows(anew=anew)
        self.draw()

    def draw(self) -> None:
        """Put what the filter lets through on the screen."""
        rows = self.trials.rows()
        trials = [row for row in rows if not row.error]
        done = sum(row.finished for row in trials)
        self._rows = self.let_through()[:MOST]
        paged = self.screen.reviewer.browser in self.trials.orders
        how = "as the queue's page shows them" if paged else "worst first"
        count = boxed(f"<b>Reviewed {done} of {len(trials)}</b>, {how}")
        table = rows_html(
            self._rows,
            self.here,
            several=self.trials.subjects.several,
            notes=self.trials.subjects.root.notes,
            people=self.trials.people.others(self.screen.page),
            at_work=self.trials.at_work(),
        )
        self._draw_fitting()
        if self.count.content != count:
            self.count.content = count
        if self.table.content != table:
            self.table.content = table

    def fit_unfitted(self) -> None:
        """Fit all subjects without a fit.

        Raises:
            SolverError: there is none.
        """
        names = self.trials.unfitted()
        if not names:
            raise SolverError("every subject has a fit already")
        self.trials.fit_all.start(names, self.screen.reviewer.name)

    def _draw_fitting(self) -> None:
        state = self.trials.fit_all.state
        content = fitting_html(state)
        unfitted = len(self.trials.unfitted()) if self.trials.subjects.several and not state.running else 0
        label = f"Fit all that have no fit ({unfitted})"
        if unfitted and self.fit_all.label != label:
            self.fit_all.label = label
        if self.fitting.content != content:
            self.fitting.content = content
        for handle, visible in (
            (self.fit_all, bool(unfitted)),
            (self.fitting, bool(content)),
            (self.cancel, state.running),
        ):
            if handle.visible != visible:
                handle.visible = visible

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

    def outside(self) -> int:
        """How many trials wait for a person that the filter does not let through."""
        waiting = len(to_review(self.trials.rows(), self.here))
        return waiting - len(to_review(self.let_through(), self.here))

    def let_through(self) -> list[Row]:
        """The rows that the queue's page of this browser shows, as long as it is open; else this panel's."""
        rows, places = self.trials.rows(), self.trials.orders.get(self.screen.reviewer.browser)
        if places is None:
            return shown(rows, Filter(self.which.value), self.words.value)
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
