"""A real browser, one for all tests of the app and the report: two would not run beside each other."""

import pytest

from tests.addb_viewer.chromium import FLAGS, installed


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
