"""Where one reviewer is: what the desks of a session share."""

from collections.abc import Sequence
from typing import Protocol

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.subjects.shared_subject import SubjectRoom
from addb_viewer.app.trial.replay import Replay


class Place(Protocol):
    """A session, as its desks see it."""

    notices: Notices
    questions: Questions

    @property
    def room(self) -> SubjectRoom:
        """The subject on the screen."""

    @property
    def replay(self) -> Replay | None:
        """The trial on the screen; None before the first one opened."""

    @property
    def frame(self) -> int:
        """The cursor."""

    @property
    def page(self) -> int:
        """The number that the server gave the browser's page."""

    @property
    def name(self) -> str:
        """Who is here; empty where nobody has said."""

    def author(self) -> str:
        """Who decides here.

        Raises:
            NameNeededError: nobody has said; the page asks, and does then what was asked for.
        """

    def seek(self, frame: int) -> None:
        """Move the cursor."""

    def go_to(self, trial: str, frame: int) -> None:
        """Show a frame of a trial of this subject."""

    def open(self, subject: str, trial: str | None) -> None:
        """Show a trial of any subject; None: its first one."""

    def draw_lanes(self) -> None:
        """Show what has changed in the lanes."""

    def trials(self) -> Sequence[str]:
        """Names of the subject's trials."""
