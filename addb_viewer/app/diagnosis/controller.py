"""The diagnosis as one browser shows it: what is kept, what is at work, and who decided what."""

import threading

import viser

from addb_viewer.app.diagnosis.panel import Actions, DiagnosisPanel
from addb_viewer.app.diagnosis.state import DiagnosisState, decision_in_words, read_state
from addb_viewer.app.jobs.job_queue import Task, TaskProgress
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.solve.controller import stop
from addb_viewer.app.subjects.shared_subject import DIAGNOSING, RECORDING, SOLVING, WITHHOLDING
from addb_viewer.app.trial.replay import Replay
from addb_viewer.diagnosis_words import verdict
from solver.errors import SolverError

OTHERS = (SOLVING, RECORDING, WITHHOLDING)  # told by other tabs
ACCEPTING = "finding the causes once more, then fitting without and with them"


class DiagnosisController:
    """Panel and state of a subject's diagnosis in one browser."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, screen: Screen, notices: Notices) -> None:
        self.screen, self.notices = screen, notices
        self.panel = DiagnosisPanel(
            gui,
            tab,
            Actions(self.diagnose, self._cancel, self.accept, self.reject, self._fit, self.screen.go_to),
            notices,
        )
        self.state = DiagnosisState()
        self.replay: Replay | None = None  # on the screen
        self.drawing = threading.Lock()  # of the panel

    def show(self) -> None:
        """Read what is kept and show it; what cannot be read is told, and the panel is then empty."""
        library = self.screen.shared.fits.shown
        try:
            self.state = read_state(library.subject, library.results, library.fit)
        except (SolverError, OSError) as error:
            self.state = DiagnosisState()
            self.notices.error("Reading the diagnosis", error)
        with self.drawing:
            self.panel.show(self.state, library.trials)
            self.panel.show_trial(self.state.figures, self.replay)
            self._progress(self.screen.shared.jobs.progress)

    def show_trial(self, replay: Replay) -> None:
        """Show what was found in the trial that is now on the screen."""
        with self.drawing:
            self.replay = replay
            self.panel.show_trial(self.state.figures, replay)

    def cursor(self, frame: int) -> None:
        """Move the cursor of the charts."""
        self.panel.charts.cursor(frame)

    def diagnose(self) -> None:
        """Look at all trials together."""
        self.screen.shared.diagnose(self.screen.reviewer.author())

    def accept(self) -> None:
        """Make the named causes part of later fits."""
        self.screen.shared.decide("Accepting", "accept", ACCEPTING, self.screen.reviewer.author())

    def reject(self) -> None:
        """Leave the named causes out of later fits."""
        self.screen.shared.decide("Rejecting", "reject", "rejecting", self.screen.reviewer.author())

    def progressed(self, progress: TaskProgress) -> None:
        """Something is at work."""
        with self.drawing:
            self._progress(progress)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        with self.drawing:
            self.panel.working(None)
            if task.doing in OTHERS:
                return
            self.panel.said(_ending(task, outcome))
        if outcome.cancelled:
            return
        if not outcome.succeeded:
            self.notices.failed(task.doing, outcome.error or "it ended without a word")
            return
        self.show()
        self.notices.tell(f"{task.doing}: done", self._told_in_short(task))

    def _cancel(self) -> None:
        stop(self.screen)

    def _fit(self) -> None:
        self.screen.shared.solve(self.screen.reviewer.author())

    def _progress(self, progress: TaskProgress | None) -> None:
        self.panel.working(progress)

    def _told_in_short(self, task: Task) -> str:
        if task.doing == DIAGNOSING and self.state.figures is not None:
            return " ".join(verdict(self.state.figures).lines)
        return decision_in_words(self.state)


def _ending(task: Task, outcome: Outcome) -> str:
    if outcome.cancelled:
        return f"{task.doing} was cancelled; nothing was written."
    return "" if outcome.succeeded else f"{task.doing} failed: {outcome.error}"
