"""Fit all that have no fit, in a real browser with the real solver: progress and failures in the rows."""

import re
import shutil

import pytest

from addb_viewer.app.app import start
from solver.fitting.results.store import has_fit

pytestmark = [pytest.mark.browser, pytest.mark.real, pytest.mark.timeout(900)]

FIT_ALL = re.compile("^Fit all that have no fit")


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
        page.get_by_role("tab", name="Queue", exact=True).click()
        page.get_by_role("button", name="Fit all that have no fit (3)").click()
        page.get_by_text("Fitting 1 of 3").wait_for()
        page.get_by_text("waits to be fitted").first.wait_for()
        page.get_by_text(re.compile("^Fitting: ")).first.wait_for()
        assert page.get_by_role("button", name=FIT_ALL).count() == 0
        before = page.session.frame
        page.keyboard.press(".")  # the page stays alive
        until(lambda: page.session.frame == before + 1)
        page.locator("#root").get_by_text("Fitted 2 of 3").wait_for()  # the bar says it too
        page.get_by_text(re.compile("⚠ not fitted: .*trial2.c3d")).wait_for()
        assert [has_fit(root / name / "results") for name in ("anna", "ben", "cut")] == [True, True, False]
        fitted = {row.subject for row in app.queue.rows() if row.figures is not None}
        assert fitted == {"anna", "ben"}

        page.get_by_role("button", name="Fit all that have no fit (1)").click()
        page.get_by_role("button", name="Cancel the fits").click()
        page.get_by_role("button", name="Fit all that have no fit (1)").wait_for()
        assert not has_fit(root / "cut" / "results")
        assert page.errors == []
        page.close()
    finally:
        app.close()
