"""What the person does: labels of the reviewer, and suggestions that they confirm or refuse."""

from functools import partial
from typing import Protocol

from addb_viewer.app.page.screen import Screen
from addb_viewer.app.review.panel import ReviewPanel, activity_named
from annotations.activities import ACTIVITIES, activity_words
from annotations.errors import ReviewError
from annotations.events import Event, RefuseActivity, SetActivity
from annotations.suggested_activity import SuggestedActivity, open_suggestions
from annotations.trial_review import TrialReview


class Review(Protocol):
    """The review of the trial on the screen, as far as activities need it."""

    screen: Screen
    panel: ReviewPanel

    @property
    def review(self) -> TrialReview:
        """The present state."""

    @property
    def chosen(self) -> tuple[int, int] | None:
        """The selected range."""

    def record(self, event: Event) -> None:
        """Record an edit."""

    def note_went(self, note: str) -> None:
        """The edit is recorded."""


class ActivityLabels:
    """Labels the activities of the trial on the screen."""

    def __init__(self, review: Review) -> None:
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
