"""Layouts of withheld forces come in beside a real fit, after it and behind all other work."""

import shutil
from dataclasses import replace

import pytest

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import open_library
from addb_viewer.app.subjects.shared_subject import WITHHOLDING
from addb_viewer.jobs.solving import job_for, solved
from solver.dynamics.cross_validation.heldout import WithheldLayout
from solver.dynamics.cross_validation.withheld_layouts import LAYOUTS
from solver.fitting.results.store import add_withheld, load_fit, present_solve


@pytest.fixture(scope="module")
def fitted(real_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("withheld") / "walk"
    shutil.copytree(real_data / "walk_gait2354_subject01", folder)
    solved(job_for(folder))
    return folder


@pytest.fixture
def app(fitted):
    """All layouts but the first of blocks and the first of steps are said to be judged, to save time."""
    results = fitted / "results"
    said = tuple(WithheldLayout(kind, number) for kind, number in LAYOUTS if number > 0)
    add_withheld(replace(load_fit(results, fitted), withheld=said), results, present_solve(results))
    app = ReviewApp(open_server(port=0), TrialQueue.of(open_library(fitted)), login="Zoë")
    yield app
    app.close()


def test_a_kept_fit_is_judged_when_asked_and_what_came_before_a_cancel_is_kept(app, enter, fitted):
    browser, (shared,) = enter(app), app.subjects.loaded
    summary, panel = browser.session.controls.fit.summary, browser.session.solving.panel

    def kept():
        return len(load_fit(fitted / "results", fitted).withheld)

    assert panel.withhold.visible
    assert "Withheld blocks" not in summary.content
    browser.click("Judge withheld forces")
    browser.until(lambda: kept() == len(LAYOUTS) - 1, "the layout that the solve has judged")
    browser.session.solving.cancel()
    browser.until(lambda: "8 of 9 so far" in summary.content, "what came")
    assert "Withheld blocks, force" in summary.content
    browser.until(lambda: panel.withhold.visible, "the button")
    assert not shared.jobs.busy
    browser.click("Judge withheld forces")
    browser.until(lambda: "Withheld whole steps, force" in summary.content, "the other one")
    assert "so far" not in summary.content
    browser.until(lambda: not panel.withhold.visible, "no button")
    assert kept() == len(LAYOUTS)


def test_a_solve_takes_its_place_is_shown_at_once_and_is_judged_after(app, enter, fitted):
    browser, (shared,) = enter(app), app.subjects.loaded
    browser.click("Judge withheld forces")
    browser.until(lambda: shared.jobs.progress is not None, "the work")
    shared.solve("Zoë")
    browser.until(lambda: shared.fits.new is not None, "the solve")
    assert shared.fits.shown.fit.withheld == ()
    browser.until((shared.fits.new.folder / "solve-1" / "withheld.json").is_file, "its first layout")
    shared.keep("Zoë")
    assert 0 < len(load_fit(fitted / "results", fitted).withheld) < len(LAYOUTS)
    kept_one = str(shared.results.absolute())
    at_work = [shared.jobs.task, *shared.jobs.waiting]
    assert (WITHHOLDING, kept_one) in [(task.doing, task.arguments[-1]) for task in at_work]
