"""Layouts of held-out forces come in beside a real fit, after it and behind all other work."""

import shutil
from dataclasses import replace

import pytest

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.shared_subject import HOLDING_OUT
from addb_viewer.jobs.solving import job_for, solved
from solver.capture.subject.opened_subject import open_subject
from solver.dynamics.cross_validation.held_out import HeldOutLayout
from solver.dynamics.cross_validation.held_out_layouts import LAYOUTS
from solver.fitting.results.store import add_held_out, load_fit, present_solve


@pytest.fixture(scope="module")
def fitted(real_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("held_out_layouts") / "walk"
    shutil.copytree(real_data / "walk_gait2354_subject01", folder)
    solved(job_for(folder))
    return folder


@pytest.fixture
def app(fitted):
    """All layouts but the first of blocks and the first of steps are said to be judged, to save time."""
    results = fitted / "results"
    said = tuple(HeldOutLayout(kind, number) for kind, number in LAYOUTS if number > 0)
    add_held_out(replace(load_fit(results, fitted), held_out_layouts=said), results, present_solve(results))
    app = ReviewApp(open_server(port=0), TrialQueue.of(library_of(open_subject(fitted))), login="Zoë")
    yield app
    app.close()


@pytest.mark.slow
def test_a_kept_fit_is_judged_when_asked_and_what_came_before_a_cancel_is_kept(app, enter, fitted):
    browser, (shared,) = enter(app), app.subjects.loaded
    summary, panel = browser.session.controls.fit.summary, browser.session.solving.panel

    def kept():
        return len(load_fit(fitted / "results", fitted).held_out_layouts)

    assert panel.hold_out.visible
    assert "Held-out blocks" not in summary.content
    browser.click("Judge held-out forces")
    browser.until(lambda: kept() == len(LAYOUTS) - 1, "the layout that the solve has judged")
    browser.session.solving.cancel()
    browser.until(lambda: "8 of 9 so far" in summary.content, "what came")
    assert "Held-out blocks, force" in summary.content
    browser.until(lambda: panel.hold_out.visible, "the button")
    assert not shared.jobs.busy
    browser.click("Judge held-out forces")
    browser.until(lambda: "Held-out whole steps, force" in summary.content, "the other one")
    assert "so far" not in summary.content
    browser.until(lambda: not panel.hold_out.visible, "no button")
    assert kept() == len(LAYOUTS)


@pytest.mark.slow
def test_a_solve_takes_its_place_is_shown_at_once_and_is_judged_after(app, enter, fitted):
    browser, (shared,) = enter(app), app.subjects.loaded
    browser.click("Judge held-out forces")
    browser.until(lambda: shared.jobs.progress is not None, "the work")
    shared.solve("Zoë")
    browser.until(lambda: shared.fits.new is not None, "the solve")
    assert shared.fits.shown.fit.held_out_layouts == ()
    browser.until((shared.fits.new.folder / "solve-1" / "held_out.json").is_file, "its first layout")
    shared.keep("Zoë")
    assert 0 < len(load_fit(fitted / "results", fitted).held_out_layouts) < len(LAYOUTS)
    kept_one = str(shared.results.absolute())
    at_work = [shared.jobs.task, *shared.jobs.waiting]
    assert (HOLDING_OUT, kept_one) in [(task.doing, task.command[-1]) for task in at_work]
