"""What if, asked in a browser: keys go on, and the last question is the one that is answered."""

import threading
from dataclasses import replace

import pytest

from solver.common.errors import SolverError
from tests.patience import PATIENCE_S

FIGURES = {"frames": 100.0, "marker_rms_m": 0.01, "moment_Nm": 5.0}
TORQUE = {"coordinate": "knee_angle_r", "Nm": 12.34, "frame": 61}


class SlowSolver:
    """Answers when it is let go; what is asked waits in `asked`."""

    def __init__(self):
        self.asked, self.go = [], threading.Event()
        self.warmed, self.is_warm = 0, False
        self.failure = None

    def warm(self):
        self.warmed += 1

    def close(self): ...

    def ask(self, trial, present, instead):
        self.asked.append((trial, present, instead))
        number = len(self.asked)
        assert self.go.wait(PATIENCE_S)
        if self.failure is not None:
            raise self.failure
        return {
            "present": {**FIGURES, "force_N": 40.0},
            "instead": {**FIGURES, "force_N": 10.0 * number},
            "torque": TORQUE,
            "seconds": 0.3,
        }


@pytest.fixture
def solver():
    return SlowSolver()


@pytest.fixture
def browser(tmp_path, make_replay, make_app, enter, solver):
    app = make_app(tmp_path, [make_replay(), make_replay("run")], login="Zoë")
    app.subjects.loaded[0].what_if = solver
    yield enter(app)
    solver.go.set()
    app.close()


def ask(browser, frames, solver):
    browser.go_to(frames)
    start = int(frames.split(":")[0])
    browser.until(lambda: (browser.session.review.chosen or (None,))[0] == start)
    before = len(solver.asked)
    browser.press("What if this range were flipped")
    browser.until(lambda: len(solver.asked) > before, "the question")


def rest_at(browser, frames):
    """Select a range; the timer that has started since."""
    asking = browser.session.review.asking
    before = asking._resting

    def started():
        return asking._resting is not before and asking._resting.ident is not None

    browser.go_to(frames)
    browser.until(started, "the range")
    return asking._resting


def test_keys_go_on_while_the_solver_thinks_and_the_last_question_is_answered(browser, solver):
    ask(browser, "20:40", solver)
    browser.until(lambda: "asking the solver" in browser.html())
    browser.press("First frame")
    browser.until(lambda: browser.session.frame == 0)
    ask(browser, "60:80", solver)
    (trial, present, instead) = solver.asked[1]
    assert trial == "walk"
    assert present.by_people == ()
    assert [(label.start, label.end) for label in instead.by_people] == [(60, 80)]
    solver.go.set()
    browser.until(lambda: "40.0 → <b>20.0</b> N" in browser.html(), "the answer")
    browser.until(lambda: browser.told("40.0 → 20.0 N"))
    browser.session.notices._hand.submit(lambda: None).result(PATIENCE_S)
    assert "40.0 → <b>10.0</b> N" not in browser.html()


def test_a_decision_is_followed_by_what_it_changes_and_only_the_last_of_several(browser, solver):
    solver.is_warm = True
    for number, frames in enumerate(("20:40", "50:60", "70:80")):
        browser.go_to(frames)
        browser.until(lambda start=int(frames[:2]): (browser.session.review.chosen or (None,))[0] == start)
        browser.press("Flag: other")
        browser.until(lambda n=number: len(browser.session.review.review.flags) > n, "the flag")
        browser.until(lambda: "asking the solver" in browser.html())
    solver.go.set()
    browser.until(lambda: "40.0 → <b>20.0</b> N" in browser.html(), "the answer")
    assert "torques change by up to 12.3 N·m: right knee torque, frame 61" in browser.html()
    first, last = solver.asked
    assert [trial for trial, _, _ in solver.asked] == ["walk", "walk"]
    assert first[1] is last[1] is None  # the kept fit
    assert [label.start for label in last[2].by_people] == [20, 50, 70]


def test_a_decision_takes_away_what_was_told_of_others_and_is_answered_to_who_stays(browser, solver):
    solver.go.set()
    ask(browser, "20:40", solver)
    browser.until(lambda: "40.0 → <b>10.0</b> N" in browser.html(), "the answer")
    browser.press("Flag: other")
    browser.until(lambda: "<b>10.0</b> N" not in browser.html())
    browser.until(lambda: "40.0 → <b>20.0</b> N" in browser.html(), "the answer to the decision")


def test_a_failure_is_told_and_nothing_is_left_asking(browser, solver):
    solver.failure = SolverError("the fit has just been replaced; ask again")
    ask(browser, "20:40", solver)
    solver.go.set()
    browser.until(lambda: browser.told("just been replaced"))
    browser.until(lambda: "asking the solver" not in browser.html())


def test_a_failure_is_not_told_to_somebody_who_has_gone_on_to_another_trial(browser, solver):
    solver.failure = SolverError("the what-if worker ended; ask again")
    ask(browser, "20:40", solver)
    browser.open_trial("run")
    browser.until(lambda: browser.session.shown == "run", "the other trial")
    solver.go.set()
    browser.until(lambda: not any(thread.name == "what if" for thread in threading.enumerate()), "its end")
    browser.session.notices._hand.submit(lambda: None).result(PATIENCE_S)
    assert not browser.told("ask again")


def test_what_cannot_be_asked_is_told(browser, solver):
    browser.press("What if this range were flipped")
    browser.until(lambda: browser.told("select the range first"))
    session = browser.session
    session._replay = replace(session.replay, residual=None)
    browser.press("What if this range were flipped")
    browser.until(lambda: browser.told("this needs a fit with forces"))
    assert solver.asked == []


def test_the_solver_is_made_ready_for_who_stays_at_a_range_not_for_who_goes_on(browser, solver):
    first = rest_at(browser, "20:40")
    second = rest_at(browser, "50:60")
    browser.open_trial("run")
    browser.until(lambda: browser.session.shown == "run", "the other trial")
    for timer in (first, second):
        timer.join(PATIENCE_S)
    assert solver.warmed == 0
    browser.go_to("20:40")
    browser.until(lambda: solver.warmed == 1, "the solver at work")


def test_the_solver_is_not_made_ready_once_the_page_is_closed(browser, solver):
    timer = rest_at(browser, "20:40")
    browser.session.close()
    timer.join(PATIENCE_S)
    assert solver.warmed == 0
