"""The Solve panel says what is compared, also when another browser or a discarded solve changes that."""

from dataclasses import replace

import pytest

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import library_of
from addb_viewer.jobs.stored_solves import add, stored_solves
from annotations.events import Status
from solver.fitting.results.store import load_fit, save_fit


@pytest.fixture
def app(small_fit):
    """A fit, and a new solve that waits to be kept or discarded."""
    results = small_fit.subject.folder / "results"
    save_fit(small_fit, results)
    add(replace(small_fit, mass_kg=90.0), results, by="Zoë", seconds=1.0)
    app = ReviewApp(open_server(port=0), TrialQueue.of(library_of(small_fit.subject)), login="Zoë")
    yield app
    app.close()


def test_nothing_is_ticked_as_compared_once_the_new_solve_is_discarded(app, enter):
    one, other = enter(app), enter(app)
    for browser in (one, other):
        browser.press("Compare with the previous solve")
        browser.until(lambda browser=browser: browser.session.solving.panel.compare.value, "the comparison")
    one.press("Discard the new solve")
    for browser in (one, other):
        browser.until(lambda browser=browser: "Nothing is compared" in browser.html(), "the fit before")
        browser.until(lambda browser=browser: not browser.session.solving.panel.compare.value, "no tick")
        browser.until(lambda browser=browser: not browser.session.solving.comparing, "no comparison")


@pytest.mark.parametrize(("name", "state"), [("Zoë", "kept"), ("Bo", "new")])
def test_t_while_a_solve_waits_says_so_and_keeps_ones_own_only(app, enter, name, state):
    browser = enter(app, name=name)
    results = app.subjects.loaded[0].results
    shown = browser.session.shown
    said = {"Zoë": "it is kept. Shift+Backspace discards it", "Bo": "it goes on waiting for Zoë"}
    browser.press("Finish the trial, go to the next")
    browser.until(lambda: browser.asked(said[name]))
    assert stored_solves(results)[-1].state == "new"
    assert app.subjects.loaded[0].reviews.review(shown).status is Status.UNSEEN
    browser.press("Finish the trial, go to the next")
    browser.until(lambda: app.subjects.loaded[0].reviews.review(shown).status is Status.FINISHED)
    assert [solve.state for solve in stored_solves(results) if solve.by == "Zoë"] == [state]


def test_solves_are_kept_and_discarded_by_key(app, enter):
    browser = enter(app)
    results = app.subjects.loaded[0].results
    add(load_fit(results, app.subjects.loaded[0].subject.folder), results, by="Zoë", seconds=1.0)
    browser.press("Discard the new solve")
    browser.until(lambda: [s.state for s in stored_solves(results) if s.by == "Zoë"] == ["discarded", "new"])
    browser.until(lambda: app.subjects.loaded[0].fits.new is not None, "the next one")
    browser.press("Yes, to the question")  # Y, where none is asked
    browser.until(lambda: [s.state for s in stored_solves(results) if s.by == "Zoë"] == ["discarded", "kept"])
    browser.press("Yes, to the question")
    browser.until(lambda: browser.told("nothing is asked, and no new solve waits"))
