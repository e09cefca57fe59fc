"""Fit all that have no fit, in a real browser with the real solver: progress and failures in the rows."""

import re
import shutil

import pytest

from addb_viewer.app.app import start
from addb_viewer.app.shell.actions import actions_of
from solver.fitting.results.store import has_fit

pytestmark = [pytest.mark.browser, pytest.mark.real, pytest.mark.timeout(900)]


@pytest.fixture
def root(real_data, tmp_path):
    """Two whole subjects and one whose recording is cut off; none has a fit."""
    for name in ("anna", "ben", "cut"):
        recording = real_data / "anomalies" / "UpsideDownData"
        shutil.copytree(recording, tmp_path / name, copy_function=shutil.copyfile)
    cut = tmp_path / "cut" / "trial2.c3d"
    cut.write_bytes(cut.read_bytes()[:3000])
    return tmp_path


@pytest.mark.slow
def test_all_are_fitted_and_the_broken_one_says_why(root, open_page, until):
    app = start(root, port=0)
    try:
        page = open_page(app)
        fit_all, cancel = (actions_of(page.session)[name] for name in ("fit_all", "cancel_fits"))
        fit_all()
        until(lambda: " of 3 that had no fit" in page.title(), "the work in the title")
        before = page.session.frame
        page.keyboard.press(".")  # the page stays alive
        until(lambda: page.session.frame == before + 1)
        until(lambda: not app.queue.fit_all.state.running, "the fits")
        page.keyboard.press("c")
        page.get_by_text(re.compile("⚠ not fitted: .*trial2.c3d")).wait_for()
        page.keyboard.press("Escape")
        assert [has_fit(root / name / "results") for name in ("anna", "ben", "cut")] == [True, True, False]
        fitted = {row.subject for row in app.queue.rows() if row.figures is not None}
        assert fitted == {"anna", "ben"}

        fit_all()
        cancel()
        until(lambda: not app.queue.fit_all.state.running, "the end of them")
        assert not has_fit(root / "cut" / "results")
        assert page.errors == []
        page.close()
    finally:
        app.close()
