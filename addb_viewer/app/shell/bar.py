"""The bar at the page's lower edge, as data: where one is, what the next key is about, solve and work."""

import threading
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from addb_viewer.app.diagnosis.diagnosis_controller import DiagnosisController
from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.jobs.job_queue import TaskProgress
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.queue.queue_controller import QueueController
from addb_viewer.app.queue.queue_rows import Row
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.review.review_controller import ReviewController
from addb_viewer.app.solve.comparison import changed_frames, torque_changes
from addb_viewer.app.solve.solve_controller import SolveController
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.text.coordinate_words import torque_in_words
from addb_viewer.text.diagnosis_vocabulary import short_title, sureness
from addb_viewer.trial_view.charts import charts_of
from addb_viewer.trial_view.forces_in_use import contact_words
from addb_viewer.trial_view.lanes import Lane
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.strip import ON_STRIP, curves_json, rows_json, trial_json
from addb_viewer.trial_view.trial_verdict import TrialVerdict, cause_against
from annotations.foot_names import foot_words
from annotations.reasons import reason_words
from annotations.wording import sure_words
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport
from solver.fitting.fit_summary import TrialFigures
from solver.fitting.verdict import Use, Why


class TimelineController:
    """What one reviewer sees over time."""

    def __init__(self, screen: Screen, compared: Callable[[], Replay | None]) -> None:
        """Show nothing yet.

        Args:
            screen: of the browser.
            compared: the trial as the solve that is compared with has it; None: nothing is compared.
        """
        self.screen, self.channel, self._compared = screen, screen.channel, compared

    def show(self) -> None:
        """Draw the trial that is on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        charts = charts_of(replay, self._compared())
        self.channel.show("trial", trial_json(self.screen.shared.name, replay))
        self.screen.draw_lanes()
        self.channel.show("curves", curves_json([c for c in charts if c.title in ON_STRIP]))

    def draw_lanes(self, lanes: tuple[Lane, ...], chosen: tuple[int, int] | None) -> None:
        """Draw what people and detection say.

        Args:
            lanes: of the trial on the screen.
            chosen: the selected range.
        """
        self.channel.show("rows", rows_json(lanes))
        self.select(chosen)

    def cursor(self, frame: int) -> None:
        """Move the cursor."""
        self.channel.show("cursor", frame)

    def select(self, frames: tuple[int, int] | None) -> None:
        """Show which range keys act on."""
        self.channel.show("selection", frames)


Chip = dict[str, Any]
TOLD_FROM, TOLD_AFTER_S = 0.02, 3.0  # share done, and [s] at work, from which the time left is worth telling


class Shown(Screen, Protocol):
    """A session, as far as its bar tells of it."""

    trials: TrialQueue
    queue: QueueController
    review: ReviewController
    solving: SolveController
    diagnosis: DiagnosisController


class Bar:
    """What the bar says; each part is replaced by itself."""

    def __init__(self, session: Shown) -> None:
        """Say nothing.

        Args:
            session: of the browser.
        """
        self._session, self._lock = session, threading.Lock()
        self._parts: dict[str, Any] = {"place": "", "of": "", "verdict": None, "solve": None}
        self._parts |= {"people": [], "chips": [], "work": []}

    def show(self) -> None:
        """Say what everybody at the trial on the screen should see; or at the subject, if none is."""
        s = self._session
        replay, others = s.replay, s.trials.people.others(s.page).get(s.queue.here, ())
        at_work = s.shared.solving or s.trials.is_being_fitted(s.shared.name)
        known, worse = replay is not None or s.shared.fits.shown.fit is None, s.solving.worse
        is_compared = s.shared.fits.new is not None and s.solving.comparing
        then = "" if not is_compared else "discard it" if worse else "keep it"
        self._say(
            **place_json(s.queue.here, s.queue.let_through()),
            verdict=verdict_json(s.verdict, at_work=at_work, then=then) if known else None,
            people=people_json(others),
            solve=solve_json(s.shared, replay, s.solving.other, worse),
        )
        self.show_work()

    def show_work(self) -> None:
        """Say what is at work."""
        s = self._session
        self._say(work=work_json(s.shared.jobs.progress, s.trials.fit_all.state))

    def show_chips(self) -> None:
        """Say what the next key acts on."""
        s = self._session
        if s.replay is not None:
            self._say(
                chips=chips_json(
                    s.review, s.replay, s.frame, s.diagnosis.uncorrected, s.diagnosis.asked_about
                )
            )

    def _say(self, **parts: Any) -> None:
        """Say this from now on, beside all that was said before."""
        with self._lock:
            self._parts |= parts
            self._session.channel.show("bar", self._parts)


def place_json(here: TrialPlace, rows: Sequence[Row]) -> dict[str, Any]:
    """Which trial it is, and the how manieth of the queue's filter.

    Args:
        here: what is on the screen.
        rows: that the queue's filter lets through.
    """
    places = [(row.subject, row.trial) for row in rows if not row.error]
    subject, trial = here
    of = "not in the queue's filter" if trial and places else ""
    if here in places:
        of = f"{places.index(here) + 1} of {len(places)}"
    place = " · ".join(name for name in (subject, trial) if name not in ("", "."))
    return {"place": place, "of": of}


def verdict_json(trial: TrialVerdict, *, at_work: bool, then: str = "") -> dict[str, Any]:
    """The first line of the page: its parts, and what a click on one does.

    Args:
        trial: where it stands.
        at_work: whether its subject is being fitted.
        then: what Y does to the new solve that has been looked at; empty where none has.
    """
    line, decides = trial.line, trial.verdict.decides
    fitting = at_work and trial.verdict.use is Use.UNKNOWN
    return {
        "sign": line.sign,
        "use": line.use,
        "band": line.band,
        "frames": line.frames,
        "why": line.why,
        "open": "it is being fitted" if fitting else line.open,
        "where": None if decides is None else WHERE.get(decides.why),
        "next": None if fitting else ["yes", then] if then else [line.next, line.doing],
    }


DECIDE = [["accept_proposal", "accept"], ["reject_proposal", "reject"]]
WHERE = {
    Why.FORCE: "worst",
    Why.MOMENT: "worst",
    Why.MARKERS: "worst_marker",
    Why.MARKER: "worst_marker",
    Why.CAUSE: "show_diagnosis",
    Why.UNEXPLAINED: "show_diagnosis",
}  # the action that leads to what decides


def chips_json(
    review: ReviewController,
    replay: Replay,
    frame: int,
    report: DiagnosisReport | None,
    asked_about: Cause | None = None,
) -> list[Chip]:
    """What the next key acts on: the range, and the proposal on it, with a cause that may be the reason.

    Args:
        review: of the trial.
        replay: the trial.
        frame: under the cursor.
        report: of the diagnosis.
        asked_about: a cause that waits for a decision where no proposal is at hand.
    """
    chosen, about, found = review.chosen, review.about, review.current
    foot = foot_words(about)
    if chosen is not None:
        seconds, most = (chosen[1] - chosen[0]) / replay.rate, replay.most_missing(*chosen, about)
        missing = "" if most is None else f" · {most.newtons:.0f} N missing at {most.frame}"
        text = f"frames {chosen[0]}–{chosen[1] - 1}, {foot} ({seconds:.2f} s){missing}"
    else:
        text = f"keys 1–9: {contact_words(replay, frame, review.foot)}"
    chips: list[Chip] = [{"text": text}]
    if found is not None:
        p = found.proposal
        against = cause_against(report, replay.name, p)
        perhaps = f" – perhaps {against} (X)" if against else ""
        where = "" if chosen is not None else f"{foot_words(p.foot)} {p.start}–{p.end - 1}: "
        chips.append(
            {
                "text": f"{where}{reason_words(p.reason)}?  {sure_words(p.confidence)} sure{perhaps}",
                "keys": DECIDE,
            }
        )
    elif asked_about is not None:
        sure = sureness(asked_about.confidence)
        chips.append({"text": f"cause: {short_title(asked_about)}?  {sure} sure", "keys": DECIDE})
    return chips


def solve_json(
    shared: SharedSubject, replay: Replay | None, other: Replay | None, worse: Sequence[str]
) -> dict[str, Any] | None:
    """The solve that waits, with its outcome in this trial.

    Args:
        shared: of the subject.
        replay: the trial on the screen.
        other: the same in the solve that is compared with.
        worse: what got worse.
    """
    new = shared.fits.new
    if new is None:
        return None
    outcome, keep, drop = _outcome(shared, replay, other), ["keep", "keep"], ["discard", "discard"]
    keys = [[*drop, "yes"], keep] if worse else [[*keep, "yes"], drop]
    if worse:
        outcome = f"worse, {', '.join(worse)}"
    return {
        "text": f"New solve{f': {outcome}' if outcome else ''} · for {new.by}",
        "worse": bool(worse),
        "keys": [*keys, ["compare", "compare"]],
    }


def _outcome(shared: SharedSubject, replay: Replay | None, other: Replay | None) -> str:
    compared = shared.fits.compared
    if compared is None or replay is None:
        return ""
    was, now = (_residual(library.figures(replay.name)) for library in (compared, shared.fits.shown))
    told = [f"residual {was} → {now} N"] if was and now else []
    changes = () if other is None else torque_changes(other, replay, changed_frames(other, replay))
    if changes and abs(changes[0].largest) >= 0.5:  # whole numbers are told
        by = f"by up to {abs(changes[0].largest):.0f} {changes[0].unit}"
        told.append(f"{torque_in_words(changes[0].name)} moved {by}")
    return ", ".join(told)


def _residual(figures: TrialFigures | None) -> str:
    linear = figures and figures.linear_residual
    return "" if linear is None else f"{linear.rms_N:.1f}"


def work_json(progress: TaskProgress | None, fitting: Fitting) -> list[dict[str, Any]]:
    """Everything at work, with the share that is done; None where the work does not say."""
    found: list[dict[str, Any]] = []
    if progress is not None:
        after = "".join(f"; then {task.words}" for task in progress.waiting)
        stage = f": {progress.stage}" if progress.stage else ""
        text = f"{progress.task.words}{stage}{left_words(progress)}{after}."
        found.append({"text": text, "seconds": round(progress.seconds), "share": progress.fraction})
    if fitting.running:
        done = fitting.fitted + len(fitting.failures)
        share = (done + (fitting.fraction or 0.0)) / max(fitting.total, 1)
        failed = f", {len(fitting.failures)} failed" if fitting.failures else ""
        left = "" if fitting.seconds_left is None else f", about {fitting.seconds_left:.0f} s left"
        text = f"Fitted {done} of {fitting.total} that had no fit{failed}{left}."
        found.append({"text": text, "seconds": round(fitting.seconds), "share": share})
    return found


def left_words(progress: TaskProgress) -> str:
    """How long it may still take; empty where nobody knows yet."""
    share, seconds = progress.fraction, progress.seconds
    if share is None or share <= TOLD_FROM or seconds <= TOLD_AFTER_S:
        return ""
    return f", about {seconds * (1 - share) / share:.0f} s left"


def people_json(others: Sequence[str]) -> list[str]:
    """Who is on the same trial."""
    if not others:
        return []
    return [f"{' and '.join(others)} {'is' if len(others) == 1 else 'are'} on this trial too."]
