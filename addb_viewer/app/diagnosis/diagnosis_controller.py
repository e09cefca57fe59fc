"""The diagnosis as one browser shows it: what is kept, what is at work, and who decided what."""

import itertools
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import viser

from addb_viewer.app.diagnosis.cards import flags_of, key_of_cause, picture_json, screen_json
from addb_viewer.app.diagnosis.diagnosis_panel import Actions, DiagnosisPanel
from addb_viewer.app.jobs.job_queue import Outcome, Task
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.subjects.shared_subject import DIAGNOSING, RECORDING, SOLVING
from addb_viewer.text.diagnosis_vocabulary import about, short_title
from addb_viewer.text.verdict_words import verdict
from addb_viewer.trial_view.diagnosis_state import DiagnosisState, decision_in_words, read_state
from addb_viewer.trial_view.proposals import as_proposed
from addb_viewer.trial_view.replay import Replay
from solver.common.errors import SolverError
from solver.diagnosis.causes.catalogue import cannot_be_accepted
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.fitting.results.extension_log import ACCEPT, REJECT
from solver.fitting.verdict import Why

OTHERS = (SOLVING, RECORDING)  # told by other tabs
ACCEPTING = "finding the causes once more, then fitting without and with them"


class DiagnosisController:
    """Panel and state of a subject's diagnosis in one browser."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, screen: Screen, notices: Notices) -> None:
        self.screen, self.notices = screen, notices
        self.panel = DiagnosisPanel(
            gui,
            tab,
            Actions(self.diagnose, self.accept, self.reject, self._fit, self.screen.go_to),
            notices,
        )
        self.state = DiagnosisState()
        self.screen.channel.on("cause", self._asked)
        self.replay: Replay | None = None  # on the screen
        self.drawing = threading.Lock()  # of the panel
        self._shown = itertools.count()  # how often the tab was asked for
        self._asked_about: Cause | None = None  # that X has shown, of the trial on the screen

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
            self._draw_screen()
        self._draw_picture()

    @property
    def asked_about(self) -> Cause | None:
        """The cause that X has shown and nobody has decided about: keys accept or reject it."""
        cause = self._asked_about
        return cause if cause is not None and self._is_open(cause) else None

    @property
    def uncorrected(self) -> DiagnosisReport | None:
        """What is known, without the causes that the fit on the screen has in its model."""
        state = self.state
        if state.figures is None:
            return None
        left = [c for c in state.figures.effects if (c.id, c.target) not in state.decided.in_fit]
        return replace(state.figures, effects=tuple(left))

    def _is_open(self, cause: Cause) -> bool:
        """Whether it limits the trial's use, and can be accepted."""
        limits = {reason.of for reason in self.screen.verdict.verdict.reasons if reason.why is Why.CAUSE}
        key, decided = (cause.id, cause.target), self.state.standings
        return " ".join(key) in limits and key not in decided and not cannot_be_accepted(cause.id)

    def show_trial(self, replay: Replay) -> None:
        """Show what was found in the trial that is now on the screen."""
        self.replay, self._asked_about = replay, None
        self._draw_picture()

    def show_reviews(self) -> None:
        """Show whether the frames of causes are flagged."""
        with self.drawing:
            self._draw_screen()

    def diagnose(self) -> None:
        """Look at all trials together."""
        self.screen.shared.diagnose(self.screen.reviewer.author())

    def diagnose_or_show(self) -> None:
        """X: what is known already is shown; else all trials are looked at."""
        if self.state.figures is None or self.state.changed:
            self.diagnose()
        else:
            self.point_out()

    def point_out(self) -> None:
        """Show the tab, and go to what it names in the trial on the screen."""
        self.screen.channel.show("tab", ["Diagnosis", next(self._shown)])
        effects = () if self.state.figures is None else self.state.figures.effects
        name = "" if self.replay is None else self.replay.name
        here = [effect for effect in effects if name in {trial for trial, _, _ in effect.frames}]
        self._asked_about = next(filter(self._is_open, here), None)
        self.screen.draw_lanes()
        for effect in here:
            if about(effect).at_certain_frames:
                self.go(effect)
                return

    def accept(self) -> None:
        """Make the named causes part of later fits."""
        self.screen.shared.decide("Accepting", ["accept"], ACCEPTING, self.screen.reviewer.author())

    def reject(self) -> None:
        """Leave the named causes out of later fits."""
        self.screen.shared.decide("Rejecting", ["reject"], "rejecting", self.screen.reviewer.author())

    def decide_one(self, kind: str, effect: Cause) -> None:
        """Accept or reject one cause; what was decided about others stays."""
        doing, stage = {ACCEPT: ("Accepting", ACCEPTING), REJECT: ("Rejecting", "rejecting")}[kind]
        command = [kind, f"--cause={effect.id}:{effect.target}"]
        self.screen.shared.decide(doing, command, stage, self.screen.reviewer.author())

    def flag(self, effect: Cause) -> None:
        """Flag the frames of a cause, so that no fit uses them."""
        assert self.state.figures is not None
        shared, author = self.screen.shared, self.screen.reviewer.author()
        library = shared.fits.shown
        flags = flags_of(self.state.figures, effect, library.trials)
        for trial, flag in flags:
            proposals = library.proposals(library.replay(trial), shared.reviews.review(trial))
            for event in as_proposed(flag, proposals):
                shared.reviews.record(trial, event, author)
        trials = ", ".join(dict.fromkeys(trial for trial, _ in flags))
        self.notices.tell(
            "Flagged", f"{short_title(effect)}, in {trials}. U there takes the last range back; G solves."
        )

    def go(self, effect: Cause) -> None:
        """Go to the frame where a cause begins, in the trial on the screen if it acts there."""
        assert self.state.figures is not None
        known = self.screen.shared.fits.shown.trials
        places = [p for p in sorted(effect.frames) if p[0] in known]
        here = [p for p in places if self.replay is not None and p[0] == self.replay.name]
        for trial, start, _ in (here or places)[:1]:
            self.screen.go_to(trial, start)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        if task.doing in OTHERS:
            return
        with self.drawing:
            self.panel.said(_ending(task, outcome))
        if outcome.cancelled:
            return
        if not outcome.succeeded:
            self.notices.failed(task.doing, outcome.error or "it ended without a word")
            return
        self.show()
        self.notices.tell(f"{task.doing}: done", self._told_key_findings(task))

    def _fit(self) -> None:
        self.screen.shared.solve(self.screen.reviewer.author())

    def _draw_screen(self) -> None:
        shared = self.screen.shared
        trials = shared.fits.shown.trials
        reviews = {trial: shared.reviews.review(trial) for trial in self._flaggable()}
        self.screen.channel.show("diagnosis", screen_json(self.state, trials, reviews))

    def _flaggable(self) -> set[str]:
        """Trials in which frames of causes can be flagged."""
        figures, known = self.state.figures, self.screen.shared.fits.shown.trials
        if figures is None:
            return set()
        return {trial for effect in figures.effects for trial, _ in flags_of(figures, effect, known)}

    def _draw_picture(self) -> None:
        self.screen.channel.show("diagnosis-picture", picture_json(self.state.figures, self.replay))

    def _asked(self, said: Any) -> None:
        """A button of a card: what it does, and the cause's key."""
        match said:
            case [str(does), str(key)] if does in CARD_ACTIONS:
                doing, action = CARD_ACTIONS[does]
                self.notices.obey(doing, lambda: self._act(action, key))

    def _act(self, action: Callable[["DiagnosisController", Cause], None], key: str) -> None:
        effects = self.state.figures.effects if self.state.figures is not None else ()
        for effect in effects:
            if key_of_cause(effect) == key:
                action(self, effect)

    def _told_key_findings(self, task: Task) -> str:
        if task.doing == DIAGNOSING and self.state.figures is not None:
            return " ".join(verdict(self.state.figures).lines)
        return decision_in_words(self.state)


CARD_ACTIONS: Mapping[str, tuple[str, Callable[[DiagnosisController, Cause], None]]] = {
    "accept": ("Accepting", lambda tab, effect: tab.decide_one(ACCEPT, effect)),
    "reject": ("Rejecting", lambda tab, effect: tab.decide_one(REJECT, effect)),
    "flag": ("Flagging", DiagnosisController.flag),
    "go": ("Going there", DiagnosisController.go),
}


def _ending(task: Task, outcome: Outcome) -> str:
    if outcome.cancelled:
        return f"{task.doing} was cancelled; nothing was written."
    return "" if outcome.succeeded else f"{task.doing} failed: {outcome.error}"
