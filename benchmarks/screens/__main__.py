"""Pictures of the app to be looked at: `python -m benchmarks.screens --out DIR`.

Ten states, four sizes (the tablet's state has its own), both themes. The pages are those of the app on the
demo's subject, fitted and diagnosed, on changed copies of it, and on a root of 500 trials made by hand. A
picture that exists is made again with `--again` only; folders that exist are kept.
"""

import argparse
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

from addb_viewer.app.app import ReviewApp, start
from benchmarks.screens.folders import folder_of
from benchmarks.screens.states import STATES, State
from tests.addb_viewer.chromium import FLAGS, installed, remembering

SIZES = ("1280x720", "1440x900", "1920x1080", "2560x1440")
TABLET = "1024x768"
THEMES = ("light", "dark")
PATIENCE_MS = 180_000
BETWEEN_LOOKS_MS = 500
MOST_LOOKS = 12  # until two in a row are alike; a clock in the picture is never still


def main() -> None:
    """Make the pictures that are missing."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    names = [state.name for state in STATES]
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    parser.add_argument("--states", nargs="+", choices=names, default=names)
    parser.add_argument("--sizes", nargs="+", default=SIZES, help="as 1280x720; the tablet's is 1024x768")
    parser.add_argument("--themes", nargs="+", choices=THEMES, default=THEMES)
    parser.add_argument("--demo", type=Path, help="the demo's folder, where it has been made; it is copied")
    parser.add_argument("--work", type=Path, help="folder of the subjects (default: OUT/subjects)")
    parser.add_argument("--again", action="store_true", help="make pictures again that exist")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    work = options.work or options.out / "subjects"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=installed(), args=FLAGS)
        for state in (state for state in STATES if state.name in options.states):
            wanted = _wanted(state, options.out, options.sizes, options.themes, again=options.again)
            if wanted:
                _take(browser, state, folder_of(state.folder, work, options.demo), wanted)
        browser.close()


def _wanted(
    state: State, out: Path, sizes: Sequence[str], themes: Sequence[str], *, again: bool
) -> list[tuple[str, str, Path]]:
    """Size, theme and file of each picture to be made."""
    all_ = [
        (size, theme, out / f"{state.name}-{size}-{theme}.png")
        for size in ((TABLET,) if state.name == "tablet" else sizes)
        for theme in themes
    ]
    return [(size, theme, file) for size, theme, file in all_ if again or not file.exists()]


def _take(browser: Browser, state: State, folder: Path, wanted: Sequence[tuple[str, str, Path]]) -> None:
    """Each picture on an untouched folder: keys of one are not to be seen in the next."""
    for size, theme, file in wanted:
        began = time.monotonic()
        with _opened(folder, copied=state.folder != "queue") as app:
            address = f"http://127.0.0.1:{app.server.get_port()}"
            if state.beside is not None:
                _page(browser, address + state.path, "800x600", "light", state.beside)
            page = _page(browser, address + state.path, size, theme, "Ada")
            state.enter(page)
            page.wait_for_function("() => !document.querySelector('#addb-notice')?.textContent")
            _settled(page, file)
            if state.failure is not None:  # it is gone after some seconds
                (session,) = (s for s in app.sessions.values() if s.memory.author == "Ada")
                session.notices.failed(*state.failure)
                page.locator("#addb-notice.error").wait_for()
                page.screenshot(path=file)
            for context in browser.contexts:
                context.close()
        print(f"{file.name}: {time.monotonic() - began:.0f} s", flush=True)


@contextmanager
def _opened(folder: Path, *, copied: bool) -> Iterator[ReviewApp]:
    place = folder.parent / "open" / "demo"  # the page names the folder
    shutil.rmtree(place, ignore_errors=True)
    if copied:
        shutil.copytree(folder, place)
    app = start(place if copied else folder, port=0)
    try:
        yield app
    finally:
        app.close()
        shutil.rmtree(place, ignore_errors=True)


def _page(browser: Browser, address: str, size: str, theme: str, name: str) -> Page:
    """A browser of somebody's own, ready for keys."""
    width, height = map(int, size.split("x"))
    page = browser.new_context(viewport={"width": width, "height": height}).new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(remembering(name, dark=theme == "dark"))
    page.goto(address)
    if not address.endswith("/queue"):
        page.locator("#addb-bar b", has_text="walk").first.wait_for()
        page.evaluate("new Promise((done) => window.addb.on('keys', () => done(true)))")
        page.locator("#addb-rows .addb-row").first.wait_for()
    return page


def _settled(page: Page, file: Path) -> None:
    """The first picture that is like the one before it."""
    before = b""
    for _ in range(MOST_LOOKS):
        page.wait_for_timeout(BETWEEN_LOOKS_MS)  # the camera glides, and is drawn slowly here
        now = page.screenshot()
        if now == before:
            break
        before = now
    file.write_bytes(before)


if __name__ == "__main__":
    main()
