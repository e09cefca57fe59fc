"""When one browser shows what happened: what others did waits its turn, what was done here does not."""

import threading
from collections.abc import Sequence
from typing import Protocol

from addb_viewer.app.jobs.job_queue import Outcome, Task, TaskProgress
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.shell.playback import Pace
from annotations.events import Edit


class Showing(Protocol):
    """A session, as far as updates need it: each method draws what has changed."""

    notices: Notices

    def show_edits(self, edits: Sequence[Edit], *, unreadable: bool) -> None:
        """Somebody recorded edits of the subject, or rows came that cannot be read."""

    def show_fit(self) -> None:
        """Another fit is on the screen, or is compared with."""

    def show_progress(self, progress: TaskProgress) -> None:
        """Something is at work."""

    def show_outcome(self, task: Task, outcome: Outcome) -> None:
        """Nothing is at work any more."""

    def show_queue(self) -> None:
        """Rows of the queue, or who is where, are others now."""


class Updates:
    """Listens to the subject on the screen, and to the queue, for one session."""

    def __init__(self, session: Showing, pace: Pace) -> None:
        """Hear nothing before somebody tells it.

        Args:
            session: of the browser.
            pace: of all browsers together.
        """
        self.session, self.pace = session, pace
        self._lock = threading.Lock()
        self._edits: list[Edit] = []  # that are not shown yet
        self._rows_came = False  # that cannot be read
        self._queue_waits = False

    def edited(self, edits: Sequence[Edit]) -> None:
        """Somebody recorded edits; none of them: a row came that cannot be read."""
        with self._lock:
            waits = bool(self._edits) or self._rows_came
            self._edits += edits
            self._rows_came |= not edits
        notices = self.session.notices
        if notices.at_hand:
            notices.guard("Showing the review", self._show_edits)()
        elif not waits:  # else whoever shows those that wait shows these as well
            notices.do("Showing the review", self._show_edits_in_turn)

    def fit_changed(self) -> None:
        """Another fit is on the screen, or is compared with."""
        self.session.notices.do("Showing the fit", self.session.show_fit)

    def progressed(self, progress: TaskProgress) -> None:
        """Something is at work."""
        self.session.show_progress(progress)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is at work any more."""
        self.session.notices.do("Showing what came of it", lambda: self.session.show_outcome(task, outcome))

    def failed(self, doing: str, error: Exception) -> None:
        """Something that all depend on failed."""
        self.session.notices.error(doing, error)

    def told(self, title: str, body: str) -> None:
        """Something happened that all should know."""
        self.session.notices.tell(title, body, important=True)

    def queue_changed(self) -> None:
        """Rows of the queue, or who is where, are others now."""
        with self._lock:
            waits, self._queue_waits = self._queue_waits, True
        if not waits:
            self.session.notices.do("Showing the queue", self._show_queue)

    def _show_queue(self) -> None:
        with self._lock:
            self._queue_waits = False
        with self.pace.turn():
            self.session.show_queue()

    def _show_edits_in_turn(self) -> None:
        with self.pace.turn():
            self._show_edits()

    def _show_edits(self) -> None:
        with self._lock:
            edits, self._edits = self._edits, []
            rows_came, self._rows_came = self._rows_came, False
        if edits or rows_came:  # else shown with earlier ones
            self.session.show_edits(edits, unreadable=rows_came)
