"""Reviewing in one browser: what keys and buttons mean for the range, the proposal and the trial at hand."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.review.comments import Comments
from addb_viewer.app.review.review_html import (
    history_html,
    proposals_html,
    ranges_html,
    suggested_html,
)
from addb_viewer.app.review.review_panel import ReviewPanel, activity_named
from addb_viewer.app.review.what_if import WhatIfQuestions
from addb_viewer.jobs.force_reviews import left_undecided
from addb_viewer.trial_view.disagreements import news
from addb_viewer.trial_view.forces_in_use import contacts_at
from addb_viewer.trial_view.frame_ranges import (
    Selection,
    Stop,
    moved_border,
    next_stop,
    place_of,
    place_said,
    stops_of,
)
from addb_viewer.trial_view.lanes import Lane, lanes_of, reviewed_ranges
from addb_viewer.trial_view.proposals import Pending, State
from annotations.activities import ACTIVITIES, activity_words
from annotations.events import (
    AcceptProposal,
    ClearRange,
    Edit,
    Event,
    FlagRange,
    Proposal,
    RefuseActivity,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
)
from annotations.foot_names import foot_words, next_foot
from annotations.reasons import FORCE_COUNTS, reason_named
from annotations.review_errors import ReviewError
from annotations.suggested_activity import SuggestedActivity, open_suggestions
from annotations.trial_review import TrialReview
from annotations.wording import said_by
from solver.diagnosis.diagnosis_report import DiagnosisReport


class ActivityLabels:
    """Labels the activities of the trial on the screen."""

    def __init__(self, review: "ReviewController") -> None:
        self._of = review

    @property
    def suggested(self) -> tuple[SuggestedActivity, ...]:
        """Activities that wait for a person."""
        replay = self._of.screen.replay
        return () if replay is None else open_suggestions(replay.suggested, self._of.review)

    @property
    def suggestion(self) -> SuggestedActivity | None:
        """The one that is selected; where nothing is selected, the one under the cursor."""
        chosen, frame = self._of.chosen, self._of.screen.frame
        if chosen is not None:
            return next((s for s in self.suggested if (s.start, s.end) == chosen), None)
        return next((s for s in self.suggested if s.start <= frame < s.end), None)

    def label(self) -> None:
        """Say what the person does in the range, or in the whole trial."""
        replay = self._of.screen.replay
        assert replay is not None
        start, end = self._of.chosen or (0, replay.frames)
        activity, subclass = activity_named(self._of.panel.activity.value)
        note = self._of.panel.next_note
        self._of.record(SetActivity(start, end, activity, subclass, note))
        self._of.note_went(note)

    def label_whole(self) -> None:
        """A: choose what is done in the whole trial; Y takes the longest suggestion."""
        replay = self._of.screen.replay
        if replay is None:
            raise ReviewError("no trial is open")
        keys = "1234567890"
        options = [
            (keys[i : i + 1], activity, partial(self._label_whole, activity, None))
            for i, activity in enumerate(ACTIVITIES)
        ]
        longest = max(self.suggested, key=lambda s: s.end - s.start, default=None)
        yes = None
        if longest is not None:
            yes = (
                f"{longest.label}, as suggested",
                partial(self._label_whole, longest.activity, longest.subclass),
            )
        self._of.screen.questions.offer(f"What does the person do in {replay.name}?", options, yes)

    def _label_whole(self, activity: str, subclass: str | None) -> None:
        replay = self._of.screen.replay
        assert replay is not None
        note = self._of.panel.next_note
        self._of.record(SetActivity(0, replay.frames, activity, subclass, note))
        self._of.note_went(note)
        self._of.screen.notices.tell("Labelled", f"The whole trial: {activity_words(activity, subclass)}.")

    def confirm(self) -> None:
        """The person does what is suggested."""
        s = self._at_hand()
        note = self._of.panel.next_note
        self._of.record(SetActivity(s.start, s.end, s.activity, s.subclass, note))
        self._of.note_went(note)

    def refuse(self) -> None:
        """The person does not do what is suggested."""
        s = self._at_hand()
        self._of.record(RefuseActivity(s.start, s.end, s.activity, s.subclass))

    def _at_hand(self) -> SuggestedActivity:
        found = self.suggestion
        if found is None:
            where = "here" if self._of.chosen is None else "on exactly the selected frames"
            raise ReviewError(f"no activity is suggested {where}; click one of the list")
        return found


class Steps:
    """Of one reviewer."""

    def __init__(self, review: "ReviewController") -> None:
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
            replay = self._screen.replay
            fitted = replay is not None and replay.bodies is not None
            review.notices.tell(
                "Nothing to decide",
                "No proposal is open, and nobody has flagged anything. T finishes the trial."
                if fitted
                else "Detection needs a fit: G fits.",
            )
            return
        self._show(found)

    def _decide(self, event: type[AcceptProposal] | type[RejectProposal]) -> None:
        review = self._review
        found = review.current
        if found is None:
            where = "here" if review.chosen is None else "on the selected frames"
            review.notices.tell("Nothing to decide", f"no open proposal {where}; N goes to the next")
            return
        review.record(event(found.proposal))
        after = [place_of(p) for p in review.proposals if p.state is State.OPEN]
        onward = next_stop(after, place_of(found), 1)
        if onward is not None:
            self._show(onward)
            return
        review.drop()
        review.notices.tell("All proposals are decided", f"Next: {self._screen.verdict.line.doing}.")

    def _show(self, stop: Stop) -> None:
        """Select it, show the frame on which most of its force is missing, and play its frames."""
        start, end, foot = stop
        replay = self._screen.replay
        most = None if replay is None else replay.most_missing(start, end, foot)
        self._screen.playback.show_loop(start, end, start if most is None else most.frame)
        self._review.stop_at(stop, Selection(start, end))


class ReviewController:
    """One reviewer's review of the trial on the screen."""

    def __init__(self, screen: Screen, panel: ReviewPanel, notices: Notices) -> None:
        self.screen, self.panel, self.notices = screen, panel, notices
        self.asking = WhatIfQuestions(screen, panel.answer, notices)
        self.activities = ActivityLabels(self)
        self.steps = Steps(self)
        self.comments = Comments(screen, panel.comments)
        self.foot: str | None = None
        self.selection = Selection()
        self.proposals: tuple[Pending, ...] = ()
        self.recorded = 0  # edits made here
        self._of = ("", "")  # subject and trial that the chosen foot is about
        self.stop: Stop | None = None  # the proposal or range that N and P have led to

    @property
    def review(self) -> TrialReview:
        """The present state of the trial's review."""
        return self.screen.shared.reviews.review(self._trial())

    @property
    def about(self) -> str | None:
        """The foot that the next key is about: that of the proposal or flag at hand, else the chosen one."""
        if self.stop is not None and (self.selection.start, self.selection.end) == self.stop[:2]:
            return self.stop[2]
        return self.foot

    @property
    def current(self) -> Pending | None:
        """The proposal that Enter and Backspace are about: that of the selection, else under the cursor."""
        chosen, frame = self.chosen, self.screen.frame
        waiting = [p for p in self.proposals if p.state is State.OPEN]
        if chosen is not None:
            return next((p for p in waiting if place_of(p) == (*chosen, self.about)), None)
        return next((p for p in waiting if p.proposal.start <= frame < p.proposal.end), None)

    @property
    def chosen(self) -> tuple[int, int] | None:
        """The selected range."""
        replay = self.screen.replay
        if replay is None:
            return None
        return self.selection.seen_from(self.screen.frame).frames(self.screen.frame, replay.frames)

    def open(self) -> None:
        """Another trial is on the screen."""
        self.selection, self.stop = Selection(), None
        if self._of != (self.screen.shared.name, self._trial()):
            self.foot, self._of = None, (self.screen.shared.name, self._trial())
        self.asking.forget()
        self.show()

    def show(self) -> None:
        """Put everything that the store says on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        review, history = self.review, self.screen.shared.reviews.history(replay.name)
        self.asking.follow(review)
        self.proposals = self.screen.shared.fits.shown.proposals(replay, review)
        self.panel.ranges.content = ranges_html(review)
        self.panel.history.content = history_html(history)
        self.comments.show()
        self.show_selection()
        self.screen.draw_lanes()

    def show_selection(self) -> None:
        """Put what keys are about on the screen."""
        replay = self.screen.replay
        if replay is not None:
            self.panel.suggested.content = suggested_html(
                self.activities.suggested, self.activities.suggestion
            )
            self.panel.proposals.content = proposals_html(
                self.proposals, self.current, replay.bodies is not None
            )

    def moved(self) -> None:
        """The cursor has moved: a range that was painted is let go."""
        self.selection = self.selection.seen_from(self.screen.frame)

    def drop(self, *, only_whole: bool = False) -> None:
        """Escape, or a click elsewhere: nothing is selected any more.

        Args:
            only_whole: a range that has one border yet, and waits for the other, stays.
        """
        if not (only_whole and not self.selection.is_whole):
            self.screen.playback.end_loop()
            self.stop_at(None, Selection())

    def range_start(self) -> None:
        """I."""
        self._select(self.selection.with_start(self.screen.frame))

    def range_end(self) -> None:
        """O."""
        self._select(self.selection.with_end(self.screen.frame))

    def select(self, start: int, end: int) -> None:
        """A range that was dragged, clicked or typed; the cursor goes to its first frame."""
        replay = self.screen.replay
        if replay is None:
            return
        start, end = max(start, 0), min(end, replay.frames)
        if start >= end:
            raise ReviewError(f"no such frames; the trial has 0–{replay.frames - 1}")
        self.stop = next((at for at in map(place_of, self.proposals) if at[:2] == (start, end)), None)
        self.screen.seek(start)
        self._select(Selection(start, end))

    def set_foot(self, foot: str | None) -> None:
        """Flags are about this foot; None: both."""
        self.foot = foot
        if self.stop is not None:
            self.stop = (*self.stop[:2], foot)
        self.show_selection()
        self.screen.draw_lanes()

    def next_foot(self) -> None:
        """F."""
        self.set_foot(next_foot(self.about, self.review.feet))

    def paint(self, key: str) -> None:
        """1 to 9 flag the range, or the contact under the cursor; 0 says that its force counts."""
        self.flag(FORCE_COUNTS if key == "0" else reason_named(key))

    def flag(self, reason: str) -> None:
        """Flag the range, or the contact under the cursor; `FORCE_COUNTS` clears it."""
        chosen = self.chosen
        places = [(*chosen, self.about)] if chosen is not None else self._contacts()
        if not places:
            whose = f" of the {foot_words(self.foot)} foot" if self.foot else ""
            raise ReviewError(
                f"no contact{whose} at frame {self.screen.frame}; select a range with I and O, or by "
                "dragging over the timeline"
            )
        note = self.panel.next_note
        for start, end, foot in places:
            if reason == FORCE_COUNTS:
                self.record(ClearRange(start, end, foot, note))
            else:
                self.record(FlagRange(start, end, reason, foot, note))
        self.note_went(note)
        if chosen is not None:
            self.screen.playback.end_loop()
            self.selection = Selection(*chosen).spent(self.screen.frame)
            self.show_selection()

    def move_border(self, flag: Stop, to: tuple[int, int]) -> None:
        """A border of a flag was dragged; arguments and errors as for `moved_border`."""
        for event in moved_border(self.review.flags, flag, to):
            self.record(event)
        self.stop = (*to, flag[2])
        self._select(Selection(*to))

    def undo(self) -> None:
        """U: the last own edit of the trial."""
        undone = self.screen.shared.reviews.undo(self._trial(), self.screen.reviewer.author())
        self.notices.tell("Undone", said_by(undone.event))
        place = place_said(undone.event)
        if place is not None:
            self.go_to(place)

    def redo(self) -> None:
        """R."""
        redone = self.screen.shared.reviews.redo(self._trial(), self.screen.reviewer.author())
        self.notices.tell("Counts again", said_by(redone.event))

    def set_status(self, status: Status, said: SetStatus | None = None) -> None:
        """Say how far the review is; what is undecided when a trial is finished stays left out.

        Args:
            status: how far.
            said: with a note, and what the trial is unusable for; None: the note of the panel.
        """
        note = self.panel.next_note
        left_out = self.left_out if status is Status.FINISHED else None
        self.record(replace(said or SetStatus(status, note), left_out=left_out))
        self.note_went(note)

    @property
    def left_out(self) -> tuple[Proposal, ...] | None:
        """What detection leaves out and nobody has decided; None where the trial has not been fitted."""
        replay, fit = self.screen.replay, self.screen.shared.fits.shown.fit
        if replay is None or replay.bodies is None:
            return None
        forces, made_from = replay.forces, fit.provenance if fit else {}
        return left_undecided(self.review, forces.proposals, replay.frames, forces.confidence, made_from)

    def warm_up(self) -> None:
        """Make the first answer to "what if" come soon, should the person stay at the selected range."""
        chosen = self.chosen
        if chosen is not None:
            self.asking.warm_up(lambda: self.chosen == chosen)

    def what_if(self) -> None:
        """The residual if the selected frames counted, or no longer did."""
        self.asking.ask(self.review, self.chosen, self.about)

    def others_edited(self, edits: Sequence[Edit]) -> None:
        """Somebody recorded edits; those of others that touch this reviewer's frames are told."""
        here = [edit for edit in edits if edit.trial == self._trial()]
        for title, body in news(here, self.review, self.screen.reviewer.name or None, self.chosen):
            self.notices.tell(title, body, important=True)
        self.show()

    def lanes(self, figures: DiagnosisReport | None) -> tuple[Lane, ...]:
        """The lanes of the trial on the screen; none before the first one opened.

        Args:
            figures: of a diagnosis; None where nobody asked.
        """
        replay, review = self.screen.replay, self.review
        if replay is None:
            return ()
        return lanes_of(
            replay,
            review,
            reviewed=reviewed_ranges(review, replay.frames),
            proposals=self.proposals,
            current=self.current,
            figures=figures,
            suggested=self.activities.suggested,
            chosen=self.chosen,
        )

    def record(self, event: Event) -> None:
        """Record an edit of the trial on the screen."""
        self.screen.shared.reviews.record(self._trial(), event, self.screen.reviewer.author())
        self.recorded += 1

    def note_went(self, note: str) -> None:
        """The edit is recorded: the box is empty again, unless something else was typed meanwhile."""
        self.notices.between_words(lambda: self.panel.drop_note(note))

    def go_to(self, stop: Stop) -> None:
        """Select frames of a foot, and go to the first."""
        self.screen.seek(stop[0])
        self.stop_at(stop, Selection(*stop[:2]))

    def stop_at(self, stop: Stop | None, selection: Selection) -> None:
        """Select frames; where they are a proposal's or a flag's, keys are about its foot."""
        self.stop = stop
        self._select(selection)
        if stop is not None:
            self.warm_up()

    def _select(self, selection: Selection) -> None:
        self.selection = selection
        self.show_selection()
        self.screen.draw_lanes()

    def _trial(self) -> str:
        if self.screen.replay is None:
            raise ReviewError("no trial is open")
        return self.screen.replay.name

    def _contacts(self) -> list[Stop]:
        """The contacts under the cursor, of the foot that flags are about."""
        replay = self.screen.replay
        return [] if replay is None else contacts_at(replay, self.screen.frame, self.foot)
