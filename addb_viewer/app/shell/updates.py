"""What one browser's session does when something happens to the subject that it shows."""

import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from addb_viewer.app.jobs.job_queue import Progress, Task
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.shell.playback import Pace
from annotations.events import Edit

if TYPE_CHECKING:
    from addb_viewer.app.shell.session import Session


class Hearing:
    """A visitor of the room: what others did waits its turn, what was done here is shown at once."""

    def __init__(self, session: "Session", pace: Pace) -> None:
        """Nothing is heard before the room is entered.

        Args:
            session: of the browser.
            pace: of all browsers together.
        """
        self.session, self.pace = session, pace
        self._lock = threading.Lock()
        self._unheard: list[Edit] = []
        self._rows_came = False  # that cannot be read
        self._queue_waits = False

    def edited(self, edits: Sequence[Edit]) -> None:
        """Somebody recorded edits; none of them: a row came that cannot be read."""
        with self._lock:
            waits = bool(self._unheard) or self._rows_came
            self._unheard += edits
            self._rows_came |= not edits
        notices = self.session.notices
        if notices.at_hand:
            notices.guard("Showing the review", self._show_edits)()
        elif not waits:  # else whoever shows those that wait shows these as well
            notices.do("Showing the review", self._show_in_turn)

    def fit_changed(self) -> None:
        """Another fit is on the screen, or is compared with."""
        self.session.notices.do("Showing the fit", self.session.show_fit)

    def progressed(self, progress: Progress) -> None:
        """Something is at work."""
        self.session.solving.progressed(progress)
        self.session.diagnosis.progressed(progress)
        self.session.recording.progressed(progress)
        self.session.show_banner()

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is at work any more."""
        session = self.session

        def conclude() -> None:
            session.solving.ended(task, outcome)
            session.diagnosis.ended(task, outcome)
            session.recording.ended(task, outcome)
            session.explain()
            session.compare_changed()
            session.show_summary()
            session.show_banner()

        session.notices.do("Showing what came of it", conclude)

    def failed(self, doing: str, error: Exception) -> None:
        """Something that all depend on failed."""
        self.session.notices.error(doing, error)

    def told(self, title: str, body: str) -> None:
        """Something happened that all should know."""
        self.session.notices.tell(title, body, "yellow")

    def queue_changed(self) -> None:
        """Rows of the queue, or who is where, are others now."""
        with self._lock:
            waits, self._queue_waits = self._queue_waits, True
        if not waits:
            self.session.notices.do("Showing the queue", self._show_queue)

    def log_changed(self) -> None:
        """The session's log began or ended."""
        self.session.notices.do("Showing the log", self.session.recording.show)

    def _show_queue(self) -> None:
        with self._lock:
            self._queue_waits = False
        with self.pace.turn():
            self.session.queue.draw()
            self.session.show_banner()

    def _show_in_turn(self) -> None:
        with self.pace.turn():
            self._show_edits()

    def _show_edits(self) -> None:
        session = self.session
        with self._lock:
            edits, self._unheard = self._unheard, []
            rows_came, self._rows_came = self._rows_came, False
        if not edits and not rows_came:  # shown with earlier ones
            return
        if rows_came or any(edit.trial == session.shown for edit in edits):
            session.review.heard(edits)
        revision = None if rows_came else max(edit.number for edit in edits)
        session.notices.do("Showing the queue", lambda: session.requeue(revision))
