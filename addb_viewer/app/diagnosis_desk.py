"""Diagnosing from the app: runs the commands in a process of their own and shows what they leave behind."""

import getpass
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import viser

from addb_viewer.app.diagnosis_panel import Actions, DiagnosisPanel
from addb_viewer.app.diagnosis_state import DiagnosisState, decision_in_words, read_state
from addb_viewer.app.effect_pictures import Figures
from addb_viewer.app.library import Library
from addb_viewer.app.notices import Notices
from addb_viewer.app.replay import Replay
from addb_viewer.app.work import Outcome, Work
from addb_viewer.diagnosis_words import verdict
from solver.errors import SolverError

PROGRAM, WORKER = "addb_viewer", "addb_viewer.app.diagnose_worker"
CLOCK_EVERY = 1.0  # [s] between two pictures of the time that has passed
ASKED_OF_ALL = "one thing at a time: wait for it, or cancel it"


class BusyError(SolverError):
    """Something is at work already."""


@dataclass(frozen=True)
class Task:
    """One command, in words for people."""

    doing: str  # as notices begin: "Diagnosing failed"
    stage: str  # while it says nothing itself
    module: str
    arguments: tuple[str, ...]


@dataclass(frozen=True)
class Surroundings:
    """What the desk needs of the app."""

    library: Callable[[], Library]
    explain: Callable[[Figures | None], None]  # draw these causes
    go_to: Callable[[str, int], None]  # trial, frame
    reload: Callable[[], None]  # read the fit anew


class DiagnosisDesk:
    """Panel, work and state of one subject's diagnosis."""

    def __init__(
        self, gui: viser.GuiApi, tab: viser.GuiTabHandle, around: Surroundings, notices: Notices
    ) -> None:
        self.around, self.notices = around, notices
        self.work = Work(self._progressed, self._ended)
        self.panel = DiagnosisPanel(
            gui,
            tab,
            Actions(self.diagnose, self.work.cancel, self.accept, self.reject, self.fit, around.go_to),
            _login_name(),
            notices,
        )
        self.state = DiagnosisState()
        self.task: Task | None = None
        self.began, self.told = 0.0, ("", -1.0)
        self.replay: Replay | None = None  # on the screen
        self.drawing = threading.Lock()  # of the panel

    def show(self) -> None:
        """Read what is kept and show it; what cannot be read is told, and the panel is then empty."""
        library = self.around.library()
        try:
            self.state = read_state(library.subject, library.results, library.fit)
        except SolverError as error:
            self.state = DiagnosisState()
            self.notices.error("Reading the diagnosis", error)
        with self.drawing:
            self.panel.show(self.state, library.trials)
            self.panel.show_trial(self.state.figures, self.replay)
        self.around.explain(self.state.figures)

    def show_trial(self, replay: Replay) -> None:
        """Show what was found in the trial that is now on the screen."""
        with self.drawing:
            self.replay = replay
            self.panel.show_trial(self.state.figures, replay)

    def cursor(self, time: float) -> None:
        """Move the cursor of the charts to a time [s]."""
        with self.drawing:
            self.panel.charts.cursor(time)

    def diagnose(self) -> None:
        """Look at all trials together."""
        folder, results = self._places()
        self._start(Task("Diagnosing", "starting", WORKER, (folder, results)))

    def accept(self) -> None:
        """Make the named causes part of later fits."""
        folder, results = self._places()
        self._start(
            Task(
                "Accepting",
                "finding the causes once more, then fitting without and with them",
                PROGRAM,
                ("accept", folder, "--out", results, "--author", self._author()),
            )
        )

    def reject(self) -> None:
        """Leave the named causes out of later fits."""
        folder, results = self._places()
        arguments = ("reject", folder, "--out", results, "--author", self._author())
        self._start(Task("Rejecting", "rejecting", PROGRAM, arguments))

    def fit(self) -> None:
        """Solve again with what was decided."""
        folder, results = self._places()
        self._start(Task("Fitting", "fitting", PROGRAM, ("fit", folder, "--out", results)))

    def close(self) -> None:
        """End what is at work."""
        self.work.cancel()

    def _places(self) -> tuple[str, str]:
        library = self.around.library()
        return str(Path(library.subject.folder).absolute()), str(library.results.absolute())

    def _author(self) -> str:
        name = self.panel.author.value.strip()
        if not name:
            raise SolverError("say who decides, in 'Decided by'")
        return name

    def _start(self, task: Task) -> None:
        if not self.work.start(task.module, task.arguments):
            doing = self.task.doing if self.task is not None else "something else"
            raise BusyError(f"{doing} is at work; {ASKED_OF_ALL}.")
        self.task, self.began, self.told = task, time.monotonic(), (task.stage, -1.0)
        with self.drawing:
            self.panel.working(task.stage)
        threading.Thread(target=self._tick, args=(task,), name="clock of the work", daemon=True).start()

    def _tick(self, task: Task) -> None:
        """Keep the clock going, also while the work says nothing."""
        while self.work.running and self.task is task:
            time.sleep(CLOCK_EVERY)
            with self.drawing:
                if self.work.running and self.task is task:
                    stage, fraction = self.told
                    known = fraction if fraction >= 0 else None
                    self.panel.progress(stage, known, time.monotonic() - self.began)

    def _progressed(self, stage: str, fraction: float) -> None:
        self.told = (stage, fraction)

    def _ended(self, outcome: Outcome) -> None:
        task = self.task
        self.notices.guard("Showing the diagnosis", self._conclude)(task, outcome)

    def _conclude(self, task: Task, outcome: Outcome) -> None:
        with self.drawing:
            self.panel.working(None)
            self.panel.said(_ending(task, outcome))
        if outcome.cancelled:
            return
        if not outcome.succeeded:
            self.notices.error(task.doing, SolverError(outcome.error or "it ended without a word"))
            return
        if task.doing == "Fitting":
            self.around.reload()
        self.show()
        self.notices.tell(f"{task.doing}: done", self._told_in_short(task))

    def _told_in_short(self, task: Task) -> str:
        if task.doing == "Diagnosing" and self.state.figures is not None:
            return " ".join(verdict(self.state.figures).lines)
        if task.doing == "Fitting":
            return "The fit on the screen is the new one."
        return decision_in_words(self.state)


def _ending(task: Task, outcome: Outcome) -> str:
    if outcome.cancelled:
        return f"{task.doing} was cancelled; nothing was written."
    return "" if outcome.succeeded else f"{task.doing} failed: {outcome.error}"


def _login_name() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return ""
