"""Asking from one browser what a range is worth, while its keys go on."""

import contextlib
import html
import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.review.review_html import what_if_html, what_if_words
from addb_viewer.jobs.force_reviews import force_review
from addb_viewer.trial_view.forces_in_use import mask_now
from addb_viewer.trial_view.html_pieces import boxed
from annotations.foot_names import foot_words
from annotations.reasons import MANUAL_REVIEW
from annotations.review_errors import ReviewError
from annotations.trial_review import TrialReview
from solver.common.errors import SolverError
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.wrenches import FrameMask

RESTS_S = 1.5  # who stays at a range that long may ask about it; who decides and goes on does not


class WhatIfQuestions:
    """One question at a time: the last one asked is the one that is answered on the screen.

    Decisions ask as well, where the solver is ready or the person rests: what they change since the kept fit.
    """

    def __init__(self, screen: Screen, answer: viser.GuiHtmlHandle, notices: Notices) -> None:
        self.screen, self.answer, self.notices, self._asked = screen, answer, notices, 0
        self._followed: tuple[str, ForceReview] | None = None  # trial on the screen, what is said of it
        self._turn = threading.Lock()  # of decisions: those that others have followed need no answer
        self._resting: threading.Timer | None = None

    def warm_up(self, still_here: Callable[[], bool], ask: Callable[[], None] | None = None) -> None:
        """Make the answer come soon, if the person stays where they are for `RESTS_S`; never waits.

        Until then processors are for the pages: several people may go through many trials.

        Args:
            still_here: whether what could be asked about is still selected; called from another thread.
            ask: what is to be asked then, if anything.
        """
        replay, what_if = self.screen.replay, self.screen.shared.what_if
        if replay is None or replay.residual is None:
            return

        def warm() -> None:
            with contextlib.suppress(SolverError):  # the subject has been closed, or has another fit
                if still_here():
                    (ask or what_if.warm)()

        self.rest_no_more()
        self._resting = threading.Timer(RESTS_S, warm)
        self._resting.daemon = True
        self._resting.start()

    def rest_no_more(self) -> None:
        """The person has gone on, or has left."""
        if self._resting is not None:
            self._resting.cancel()

    def ask(self, review: TrialReview, chosen: tuple[int, int] | None, foot: str | None) -> None:
        """The residual if the selected frames counted, or no longer did.

        Args:
            review: of the trial on the screen.
            chosen: the range; None where nothing is selected.
            foot: that it is about; None for all.

        Raises:
            ReviewError: there is nothing to ask about.
        """
        replay = self.screen.replay
        if replay is None or replay.residual is None:
            raise ReviewError("this needs a fit with forces; G solves")
        if chosen is None:
            raise ReviewError("select the range first: I and O, N, or drag over the timeline")
        present, mask = force_review(review), mask_now(replay.feet, replay.forces, review)
        if mask is None:
            raise ReviewError("a label does not fit this recording; G says which")
        instead, words = flipped(present, mask, chosen, foot, replay.feet)
        question = self._question(replay.name, present, instead, words)
        threading.Thread(target=question, name="what if", daemon=True).start()

    def follow(self, review: TrialReview) -> None:
        """Tell what a decision changes, once the solver knows.

        Args:
            review: of the trial on the screen, after it.
        """
        replay, what_if = self.screen.replay, self.screen.shared.what_if
        if replay is None:
            return
        now = (replay.name, force_review(review))
        before, self._followed = self._followed, now
        if before is None or now == before or replay.residual is None:
            return
        question = self._question(replay.name, None, now[1], "Decided here since the kept fit")

        def in_turn() -> None:
            with self._turn:
                question()

        if what_if.is_warm:
            threading.Thread(target=in_turn, name="what if", daemon=True).start()
        else:
            self.answer.content = ""  # it was about other decisions
            self.warm_up(lambda: now == self._followed, in_turn)

    def _question(
        self, trial: str, present: ForceReview | None, instead: ForceReview, words: str
    ) -> Callable[[], None]:
        """What asks the solver, and shows its answer; nothing where another question has come since."""
        self._asked += 1
        number, what_if = self._asked, self.screen.shared.what_if
        asking = boxed(f"<b>{html.escape(words)}</b><br>asking the solver …")

        def ask() -> None:
            if number != self._asked:
                return
            self.notices.do("Asking", lambda: self._show(number, asking))
            try:
                told = what_if.ask(trial, present, instead)
            except SolverError as failure:
                error = failure  # Python forgets the other name
                self.notices.do("Answering", lambda: self._tell_why_not(number, error))
                return
            answer, line = what_if_html(told, words), what_if_words(told) if present is not None else ""
            self.notices.do("Answering", lambda: self._show(number, answer, words, line))

        return ask

    def forget(self) -> None:
        """What was asked is about another trial."""
        self.rest_no_more()
        self._asked += 1
        self._followed = None
        self.answer.content = ""

    def _tell_why_not(self, number: int, error: SolverError) -> None:
        """Unless nobody waits for it any more: who left the trial has ended the worker."""
        if number == self._asked:
            self.answer.content = ""
            self.notices.error("Asking what if", error)

    def _show(self, number: int, answer: str, words: str = "", key_findings: str = "") -> None:
        if number != self._asked:
            return
        self.answer.content = answer
        if key_findings:  # the panel may be scrolled away, or another one may be open
            self.notices.tell(words, key_findings)


def flipped(
    present: ForceReview, mask: FrameMask, chosen: tuple[int, int], foot: str | None, feet: tuple[str, ...]
) -> tuple[ForceReview, str]:
    """A person's decision on a range turned round: what is mostly left out counts, and the other way round.

    Args:
        present: what people say.
        mask: what comes of that, and of detection.
        chosen: the range.
        foot: that it is about; None for all.
        feet: the mask's.

    Returns:
        What they would say instead, and in words what is asked.
    """
    start, end = chosen
    counts = mask.counts[start:end, slice(None) if foot is None else feet.index(foot)]
    where = f"frames {start} to {end - 1}, {foot_words(foot)}"
    if np.mean(counts) > 0.5:
        label, words = ForceLabel(start, end, foot, MANUAL_REVIEW), f"If {where}, did not count"
    else:
        label, words = ForceLabel(start, end, foot, None), f"If {where}, counted"
    # An erroneous stretch holds whatever else is said; asked about, it is a flag like any other.
    said = [each._replace(reason=each.reason and MANUAL_REVIEW) for each in present.by_people]
    return replace(present, by_people=(*said, label)), words
