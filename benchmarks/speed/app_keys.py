"""The app: how long its keys take, and how soon its queue is there.

The server, the players and who is timed are processes of their own. A time of a browser without a picture
ends when the message that holds the echo has arrived; of Chromium, when the picture is painted.
"""

import argparse
import faulthandler
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from addb_viewer.app.app import start
from benchmarks.markdown import table
from benchmarks.speed.command_costs import write_repeated_walk
from benchmarks.speed.measuring import cost_of, resident_megabytes, running, until_told_to_end
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.root_of_many import write_root
from tests.addb_viewer.chromium import FLAGS, installed

MODULE = "benchmarks.speed.app_keys"
FRAMES, TRIALS = 10_000, 10  # of the walk whose keys are timed; players
FEW = 4  # who play at once in a laboratory
TIMES = 40  # of each act
PAUSE_S = 0.05  # between two acts
SETTLE_S = 2.0  # until all play
LENGTH = 40  # frames that are painted at once
EVERY = 97  # frames from one painted range to the next
QUEUED, READY_MS, LIMIT_PX = 500, 60_000, 30_000  # trials in the queue; scrolled through


def serve(root: Path) -> None:
    """Be the server of a folder: its port is the first line that is said."""
    faulthandler.register(signal.SIGUSR1)  # says where each thread is
    app = start(root, port=0)
    print(app.server.get_port(), flush=True)
    try:
        until_told_to_end()
    finally:
        app.close()


def play(port: int, players: int, solve: bool) -> None:
    """Be some browsers, each of which plays a trial of its own; one asks for a solve before."""
    places = [[f"walk-{k + 1}", "walk"] for k in range(players)]
    browsers = [PaperBrowser(port, name=at[0], at=at) for at in places]
    for browser in browsers:
        browser.until(lambda browser=browser: browser.trial and browser.row_blocks(), "its trial")
    if solve:
        browsers[0].press("Solve again")
    for browser in browsers:
        browser.press("Play or pause")
    print("playing", flush=True)
    until_told_to_end()


def copies(subject: Path, root: Path, times_over: int) -> None:
    """A subject some times over, without any review."""
    for k in range(times_over):
        ignored = shutil.ignore_patterns("annotations.*", "solves")
        shutil.copytree(subject, root / f"{subject.name}-{k + 1}", ignore=ignored)


def latency_section(folder: Path, frames: int = FRAMES) -> str:
    """From a key to its echo: alone, beside four players, and beside ten while one trial is solved.

    Args:
        folder: for subjects; a fit that is there is not made again.
        frames: of the trial.
    """
    walk, root = folder / "walk", folder / "root"
    if not walk.is_dir():
        write_repeated_walk(walk, frames)
        cost_of("fit", str(walk))
    shutil.rmtree(root, ignore_errors=True)
    copies(walk, root, TRIALS + 1)
    with running(MODULE, "serve", str(root)) as (server, said):
        port, began = int(said), time.perf_counter()
        with closing(PaperBrowser(port, at=[f"walk-{TRIALS + 1}", "walk"])) as browser:
            browser.until(lambda: browser.trial and browser.row_blocks(), "the trial")
            opened = time.perf_counter() - began
            alone = _times(browser, 30)
            one = resident_megabytes(server.pid)
            with running(MODULE, "play", str(port), str(FEW)):
                time.sleep(SETTLE_S)
                beside_few = _times(browser, frames // 2 + 30)
            with running(MODULE, "play", str(port), str(TRIALS), "--solve"):
                time.sleep(SETTLE_S)
                shared = _times(browser, 10)
                ten = resident_megabytes(server.pid)
    head = ["median (95th percentile) [ms]", "alone", f"{FEW} play", f"{TRIALS} play, one solve runs"]
    rows = [[act, *(_shown(of[act]) for of in (alone, beside_few, shared))] for act in alone]
    return (
        f"{table(head, rows)}\n\nThe first picture of a trial is there {opened:.1f} s after a browser "
        f"connects.\nMemory of the server: {one:.0f} MB with one trial open, {ten:.0f} MB with {TRIALS + 1} "
        f"trials of {frames} frames open\nin as many browsers."
    )


def _times(browser: PaperBrowser, first: int) -> dict[str, list[float]]:
    """Milliseconds of every act, by its name.

    Args:
        browser: whose keys are timed.
        first: frame of the first range that is painted.
    """
    browser.until(lambda: browser.verdict, "the page")
    times: dict[str, list[float]] = {"step": [], "seek": [], "paint": []}

    def is_on(frame: int) -> bool:
        return bool(browser.frame == frame)

    def is_painted(start: int, reason: str) -> bool:
        blocks = browser.row_blocks()
        return any((a, b) == (start, start + LENGTH) and told.startswith(reason) for a, b, told in blocks)

    browser.go_to("5")
    browser.until(partial(is_on, 5), "frame 5")
    for k in range(TIMES):
        step = partial(browser.press, "One frame on")
        times["step"].append(_timed(browser, step, partial(is_on, 6 + k), "the next frame"))
    for k in range(TIMES):
        frame = 20 + EVERY * k
        go = partial(browser.go_to, str(frame))
        times["seek"].append(_timed(browser, go, partial(is_on, frame), f"frame {frame}"))
    for k in range(TIMES):
        start, key = first + EVERY * k, ("Flag: force wrong", "Flag: moment wrong")[k % 2]
        browser.go_to(f"{start}:{start + LENGTH}")
        chosen = f"frames {start}–{start + LENGTH - 1},"
        browser.until(lambda chosen=chosen: chosen in browser.html(), chosen)
        time.sleep(PAUSE_S)
        painted = partial(is_painted, start, key.removeprefix("Flag: "))
        times["paint"].append(_timed(browser, partial(browser.press, key), painted, key))
    return times


def _timed(browser: PaperBrowser, act: Callable[[], None], echoed: Callable[[], bool], what: str) -> float:
    start = time.perf_counter()
    act()
    browser.until(echoed, what)
    taken = time.perf_counter() - start
    time.sleep(PAUSE_S)
    return 1e3 * taken


def _shown(times: Sequence[float]) -> str:
    return f"{np.median(times):.0f} ({np.percentile(times, 95):.0f})"


def queue_section() -> str:
    """How soon the queue of 500 trials is on Chromium's screen [ms], and the page's heap [MB]."""
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        root = Path(scratch) / "root"
        write_root(root, QUEUED)
        began = time.perf_counter()
        with closing(start(root, port=0)) as app:
            found = {"the app starts, all rows read": 1e3 * (time.perf_counter() - began)}
            browser = playwright.chromium.launch(executable_path=installed(), args=FLAGS)
            page = browser.new_page(viewport={"width": 1920, "height": 1080})
            page.set_default_timeout(READY_MS)
            for visit in ("first", "second"):
                began = time.perf_counter()
                page.goto(f"http://127.0.0.1:{app.server.get_port()}/queue")
                _painted(page)
                found[f"{visit} visit, rows painted"] = 1e3 * (time.perf_counter() - began)
            found |= _acts(page)
            browser.close()
    return table([f"{QUEUED} trials", "ms"], [[what, f"{value:.3g}"] for what, value in found.items()])


def _painted(page: Page) -> None:
    page.locator("#space .row:not([hidden]) a").nth(10).wait_for()
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def _acts(page: Page) -> dict[str, float]:
    """Sorting, filtering and scrolling, timed in the page until the next picture."""
    timed = """async (act) => {
        const picture = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
        await picture();
        const began = performance.now();
        act === "sort" && document.querySelector("#head [title^='The larger']").click();
        act === "filter" && document.querySelector("[data-chip=todo]").click();
        if (act === "scroll") {
            const scroll = document.getElementById("scroll");
            const steps = Math.min(%d, scroll.scrollHeight - scroll.clientHeight) / 200;
            for (let k = 0; k < steps; k++) {
                scroll.scrollTop += 200;
                await new Promise(done => requestAnimationFrame(done));
            }
            return (performance.now() - began) / steps;
        }
        await picture();
        return performance.now() - began;
    }"""
    names = {"sort": "sorted by another column", "filter": "filtered", "scroll": "a step of scrolling"}
    found = {words: page.evaluate(timed % LIMIT_PX, act) for act, words in names.items()}
    page.evaluate("globalThis.gc?.()")
    heap = page.evaluate("performance.memory.usedJSHeapSize")
    elements = page.evaluate("document.querySelectorAll('#space .row').length")
    return {**found, "heap [MB]": heap / 1e6, "rows that are elements": elements}


def main() -> None:
    """Be one of the processes."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}")
    parser.add_argument("what", choices=("serve", "play"))
    parser.add_argument("place", help="the root, or the port")
    parser.add_argument("players", nargs="?", type=int, default=0)
    parser.add_argument("--solve", action="store_true")
    given = parser.parse_args()
    if given.what == "serve":
        serve(Path(given.place))
    else:
        play(int(given.place), given.players, given.solve)


if __name__ == "__main__":
    main()
