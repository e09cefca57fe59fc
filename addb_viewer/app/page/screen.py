"""What is on the screen of one browser, and who is there: as the tabs of its page see it."""

from typing import Protocol

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.page.reviewer import Reviewer
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.trial_verdict import TrialVerdict


class Loops(Protocol):
    """What plays the trial."""

    def show_loop(self, start: int, end: int, frame: int) -> None:
        """Move the cursor, and after a moment play frames start to end − 1 again and again."""

    def end_loop(self) -> None:
        """Pause if a range is being played again and again."""


class Screen(Protocol):
    """A session, as its tabs see it."""

    channel: Channel
    notices: Notices
    questions: Questions
    reviewer: Reviewer

    @property
    def playback(self) -> Loops:
        """What plays the trial."""

    @property
    def shared(self) -> SharedSubject:
        """The subject on the screen."""

    @property
    def replay(self) -> Replay | None:
        """The trial on the screen; None before the first one opened."""

    @property
    def verdict(self) -> TrialVerdict:
        """Where the trial on the screen stands."""

    @property
    def frame(self) -> int:
        """The cursor."""

    @property
    def playing(self) -> bool:
        """Whether the cursor runs."""

    @property
    def page(self) -> int:
        """The number that the server gave the browser's page."""

    def seek(self, frame: int) -> None:
        """Move the cursor."""

    def go_to(self, trial: str, frame: int) -> None:
        """Show a frame of a trial of this subject."""

    def open(self, subject: str, trial: str | None) -> None:
        """Show a trial of any subject; None: its first one."""

    def draw_lanes(self) -> None:
        """Show what has changed in the lanes."""
