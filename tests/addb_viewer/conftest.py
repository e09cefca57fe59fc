"""A real browser, one for all tests of the app and the report, and a fit of two trials: seconds."""

import shutil
from pathlib import Path

import pytest

from addb_viewer import Subject
from solver.diagnosis.diagnosis import Diagnosis, Remaining
from tests.addb_viewer.chromium import FLAGS, installed

MARKERS_ALONE = "[trajectory]\nenabled = false\n"
CLEAN = Diagnosis("clean", (), (), {}, Remaining(9.0, 9.8), ("walk",), rates_Hz={"walk": 100.0})


@pytest.fixture(scope="session")
def fit_of_two(tmp_path_factory):
    """A folder with a walk, flagged on frames of it, and a squat, fitted by the markers alone."""
    subject = Subject.demo(tmp_path_factory.mktemp("demo") / "subject", trials=("walk", "squat"))
    (subject.folder / "settings.toml").write_text(MARKERS_ALONE)
    subject.flag("walk", 100, 140, author="anna")
    assert subject.fit().trials == ("squat", "walk")
    return subject.folder


@pytest.fixture
def folder(fit_of_two, tmp_path, monkeypatch):
    """A copy of it; diagnoses and the demo cost nothing, and the app ends at once."""
    monkeypatch.setattr("addb_viewer.jobs.diagnosing.diagnosis_of", lambda *_, **__: CLEAN)
    for module in ("jobs", "commands"):
        monkeypatch.setattr(f"addb_viewer.{module}.demo.make_demo", lambda *_, **__: None)
    monkeypatch.setattr("addb_viewer.app.app._until_interrupted", _interrupt)
    (tmp_path / "beside").mkdir()
    return Path(shutil.copytree(fit_of_two, tmp_path / "subject"))


def _interrupt():
    raise KeyboardInterrupt


@pytest.fixture(scope="session")
def browser():
    """Debian's Chromium, headless, software rendering."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = installed()
    if chromium is None:
        pytest.skip("no Chromium on PATH (Debian: apt install chromium)")
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, headless=True, args=FLAGS)
        yield browser
        browser.close()
