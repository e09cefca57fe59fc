"""An hour's work of four reviewers on one server: does its memory grow, and that of a page?

`python -m benchmarks.working_hour ROOT` takes the trials of `benchmarks.review_by_key ROOT --only-fit`, each
subject several times over. Three reviewers are browsers without a picture; the fourth is Chromium, with keys,
pointer, tabs and curves. They decide proposals at random (with a seed), flag, undo, play, ask what if, solve
now and then (with the real solver), finish, and go on to the next trial. Every minute the server's resident
memory is read, Chromium's heap after its garbage is gone, and how long it takes from a key to the painted
cursor.
"""

import argparse
import faulthandler
import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from playwright.sync_api import CDPSession, Page, sync_playwright

from addb_viewer.app.app import start
from addb_viewer.app.queue.controller import READ_S
from addb_viewer.app.shell.commands import COMMANDS
from benchmarks.processes import resident_megabytes, running, until_told_to_end
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.chromium import FLAGS, installed, remembering

MODULE = "benchmarks.working_hour"
PEOPLE = ("Anna", "Ben", "Chen", "Dora")  # the last one has Chromium
TIMES_OVER = 30  # each subject
BETWEEN_KEYS_S = 1.0
PLAYED_S = 6.0
OPENED_S = 3.0  # for the next trial; then the key is pressed again
MOST_TIMES_T = 15
SOLVED_EVERY_S = 600.0  # by each person
SETTLED_S = 600.0  # from when on memory is to stay
EVERY_S = 60.0
STEPS = 10  # whose cursor is timed, each minute
PATIENCE_MS = 120_000
T, NEXT = "Finish the trial, go to the next", "Next proposal or flagged range"
ACCEPT, REJECT, UNDO, REDO = "Accept the proposal", "Reject the proposal", "Undo", "Redo"
WORST, FLAG, WHAT_IF = "Worst frame that counts", "Flag: force wrong", "What if this range were flipped"
TABS = ("Review", "Solve", "Curves", "Diagnosis", "Review")

CURSOR = """(() => {
    window.cursorTimes = [];
    let pressed = null;
    const marked = () => document.querySelector("[data-addb-cursor]");
    const note = (event) => {  // ahead of the page's own keys, which let none through
        if (event.key === "." && marked()?.style.left !== "100%") pressed = event.timeStamp;
    };
    window.addEventListener("keydown", note, true);
    const watch = () => {
        const cursor = marked();
        if (!cursor) return setTimeout(watch, 200);
        new MutationObserver(() => {
            if (pressed === null) return;
            const began = pressed;
            pressed = null;
            requestAnimationFrame(() => setTimeout(() => window.cursorTimes.push(performance.now() - began)));
        }).observe(cursor, { attributes: true, attributeFilter: ["style"] });
    };
    watch();
})();"""  # from a key that steps to the picture with the cursor moved [ms]; the last frame has no next one


@dataclass
class Minute:
    """What was read at one time."""

    at_s: float  # since all began to work
    server_mb: float
    heap_mb: float | None = None  # of Chromium's page
    finished: int = 0  # trials, by all


@dataclass
class Work:
    """What the four share."""

    server: "subprocess.Popen[str]"
    ends_at: float  # by `time.monotonic`
    finished: int = 0
    acts: int = 0
    stuck: list[str] = field(default_factory=list)
    failed: list[BaseException] = field(default_factory=list)

    @property
    def is_over(self) -> bool:
        """Whether the hour is over, or somebody can go on no more."""
        return bool(self.failed) or time.monotonic() > self.ends_at


@contextmanager
def copies(root: Path, times_over: int) -> Iterator[Path]:
    """Each subject some times over, without any review, in a folder that goes."""
    with tempfile.TemporaryDirectory(dir=root.parent) as scratch:  # on the disk, as recordings are
        for subject in sorted(child for child in root.iterdir() if child.is_dir()):
            for k in range(times_over):
                ignored = shutil.ignore_patterns("annotations.*", "solves")
                shutil.copytree(subject, Path(scratch) / f"{subject.name}-{k + 1}", ignore=ignored)
        yield Path(scratch)


class Reviewer:
    """One who works by command, in a browser of either kind."""

    def __init__(self, work: Work, seed: int, name: str) -> None:
        self.work, self.random, self.solved_at = work, random.Random(seed), time.monotonic()
        self.name = name

    def press(self, label: str) -> None:
        """One key."""
        raise NotImplementedError

    def place(self) -> str:
        """The trial on the screen, by its words in the bar."""
        raise NotImplementedError

    def proposals(self) -> int:
        """How many are open."""
        raise NotImplementedError

    def waits(self) -> bool:
        """Whether a new solve of one's own waits; about others' the app asks whether that is meant."""
        raise NotImplementedError

    def notices(self) -> list[str]:
        """All that was told, oldest first."""
        raise NotImplementedError

    def aside(self) -> None:
        """What is done besides, once a trial."""

    def begin_anew(self) -> None:
        """What is done by somebody who is stuck."""

    def pause(self, seconds: float) -> None:
        """As long as a person takes."""
        time.sleep(seconds)

    def do(self, *labels: str) -> None:
        """Some keys, one after the other."""
        for label in labels:
            self.press(label)
            self.work.acts += 1
            self.pause(BETWEEN_KEYS_S)

    def review(self) -> None:
        """The trial on the screen, up to the next one."""
        place, choose = self.place(), self.random
        for _ in range(min(self.proposals(), 8)):
            self.do(NEXT, choose.choice((ACCEPT, REJECT)))
        self.do("Play or pause")
        self.pause(PLAYED_S)
        self.do("Stop", WORST, FLAG, "No, to the question", *choose.choice(((UNDO,), (UNDO, REDO), ())))
        self.do(*["One frame on"] * 5, *["1 s on"] * 2, "First frame")
        if choose.random() < 0.2:
            self.do(NEXT, WHAT_IF)
        self.aside()
        if time.monotonic() - self.solved_at > SOLVED_EVERY_S:
            self.solved_at = time.monotonic()
            self.do("Solve again")
        if self.waits():
            self.do(choose.choice(("Keep the new solve (so does Y)", "Discard the new solve")))
        for times in range(1, MOST_TIMES_T + 1):  # the first one may only say what speaks against it
            self.do(T)
            if self._until(lambda: self.place() != place, READ_S + OPENED_S):
                self.work.finished += 1
                return
            if times % 3 == 0:  # a question may keep T away; no to it makes T say again what it said
                self.do("No, to the question", *(["Discard the new solve"] if self.waits() else []))
        self.work.stuck.append(f"T does not leave {place}: {self.notices()[-MOST_TIMES_T:]}")
        print(self.work.stuck[-1], flush=True)
        self.work.server.send_signal(signal.SIGUSR1)
        self.begin_anew()

    def _until(self, happened: Callable[[], bool], seconds: float) -> bool:
        end = time.monotonic() + seconds
        while not happened() and time.monotonic() < end:
            self.pause(0.1)
        return happened()


class PaperReviewer(Reviewer):
    """Without a picture."""

    def __init__(self, work: Work, seed: int, port: int, name: str) -> None:
        super().__init__(work, seed, name)
        self.browser = PaperBrowser(port, name=name)
        self.browser.until(self.place, "the first trial")

    def press(self, label: str) -> None:
        """As its key does."""
        self.browser.press(label)

    def place(self) -> str:
        """By the bar."""
        return str(self.browser.bar.get("place", ""))

    def proposals(self) -> int:
        """By the bar."""
        return _leading_number(str(self.browser.bar.get("open") or ""))

    def waits(self) -> bool:
        """By the bar."""
        told = str((self.browser.bar.get("solve") or {}).get("text", ""))
        return told.startswith("New solve") and told.endswith(f"for {self.name}")

    def notices(self) -> list[str]:
        """Of the channel."""
        return [f"{title}: {body}" for title, body in self.browser.notices]

    def work_on(self) -> None:
        """Until the hour is over."""
        try:
            while not self.work.is_over:
                self.review()
        except Exception as error:  # told by the one who reads the memory
            self.work.failed.append(error)
        finally:
            self.browser.close()


class ChromiumReviewer(Reviewer):
    """With a picture, keys, a pointer, tabs and curves."""

    def __init__(
        self, work: Work, seed: int, page: Page, keys: dict[str, str], every: Callable[[], None]
    ) -> None:
        super().__init__(work, seed, PEOPLE[-1])
        self.page, self._keys, self._every = page, keys, every
        self._tab = 0

    def press(self, label: str) -> None:
        """A key of its command."""
        self.page.keyboard.press(self._keys[label])

    def place(self) -> str:
        """By the bar."""
        return self.page.locator("#addb-bar b").first.text_content() or ""

    def proposals(self) -> int:
        """By the bar."""
        found = self.page.locator("#addb-bar").get_by_text("proposal").first
        return _leading_number(found.text_content() or "") if found.count() else 0

    def waits(self) -> bool:
        """By the bar."""
        return self.page.locator("#addb-bar").get_by_text(f"for {self.name}").count() > 0

    def notices(self) -> list[str]:
        """The last one, beside the bar."""
        return self.page.locator("#addb-notice").all_text_contents()

    def begin_anew(self) -> None:
        """With a page that is loaded again; a picture of the old one stays."""
        self.page.screenshot(path=Path(tempfile.gettempdir()) / f"stuck-{len(self.work.stuck)}.png")
        print(self.page.evaluate("document.activeElement.outerHTML.slice(0, 300)"), flush=True)
        self.page.reload()
        self.page.locator("#addb-rows .addb-row").first.wait_for()

    def pause(self, seconds: float) -> None:
        """While the page lives on; and what is due every minute."""
        self.page.wait_for_timeout(1e3 * seconds)
        self._every()

    def aside(self) -> None:
        """The timeline by pointer, and another tab."""
        page, box = self.page, self.page.locator("[data-addb-timeline]").first.bounding_box()
        assert box is not None
        left, top, width = box["x"] + 0.3 * box["width"], box["y"] + 40, 0.3 * box["width"]
        page.mouse.move(left, top)
        page.mouse.down()
        page.mouse.move(left + width * self.random.random(), top, steps=5)
        page.mouse.up()
        for notches in (-200, -200, 400, 400):
            page.mouse.wheel(0, notches)
            self.pause(BETWEEN_KEYS_S)
        page.keyboard.press("Escape")
        self._tab += 1
        page.get_by_role("tab", name=TABS[self._tab % len(TABS)], exact=True).click()
        self.pause(2.0)


def _leading_number(text: str) -> int:
    first = text.split(" ", maxsplit=1)[0]
    return int(first) if first.isdigit() else 0


class Readings:
    """Memory of server and page, and the cursor's times, by minute."""

    def __init__(self, server: int, page: Page, developer: CDPSession, work: Work) -> None:
        self.minutes: list[Minute] = []
        self.cursor_ms: list[float] = []  # from a key to the painted cursor
        self._server, self._page, self._developer, self._work = server, page, developer, work
        self._began = self._due = time.monotonic()

    def read_when_due(self) -> None:
        """Once a minute."""
        if time.monotonic() < self._due:
            return
        self._due += EVERY_S
        for _ in range(STEPS):
            self._page.keyboard.press(".")
            self._page.wait_for_timeout(300)
        self.cursor_ms += self._page.evaluate("window.cursorTimes.splice(0)")
        self._developer.send("HeapProfiler.collectGarbage")
        values = self._developer.send("Performance.getMetrics")["metrics"]
        heap = next(value["value"] for value in values if value["name"] == "JSHeapUsedSize") / 1e6
        at = time.monotonic() - self._began
        minute = Minute(at, resident_megabytes(self._server), heap, self._work.finished)
        self.minutes.append(minute)
        print(f"{at / 60:5.1f} min: server {minute.server_mb:.0f} MB, page {heap:.1f} MB, "
              f"{minute.finished} trials finished, {self._work.acts} acts", flush=True)  # fmt: skip


def worked(root: Path, seconds: float) -> tuple[Sequence[Minute], list[float]]:
    """What was read while the four worked.

    Args:
        root: of the subjects; is written to.
        seconds: how long.

    Raises:
        RuntimeError: somebody could not go on.
    """
    with running(MODULE, "--serve", str(root)) as (server, said), sync_playwright() as playwright:
        port = int(said)
        browser = playwright.chromium.launch(executable_path=installed(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE_MS)
        page.add_init_script(remembering(PEOPLE[-1]))
        page.add_init_script(CURSOR)
        page.goto(f"http://127.0.0.1:{port}")
        page.locator("#addb-bar b").first.wait_for()
        page.evaluate("new Promise((done) => window.addb.on('keys', () => done(true)))")
        page.locator("#addb-rows .addb-row").first.wait_for()
        developer = page.context.new_cdp_session(page)
        developer.send("Performance.enable")
        work = Work(server, time.monotonic() + seconds)
        papers = [PaperReviewer(work, k, port, name) for k, name in enumerate(PEOPLE[:-1])]
        threads = [threading.Thread(target=paper.work_on) for paper in papers]
        readings = Readings(server.pid, page, developer, work)
        keys = {command.label: command.keys[0] for command in COMMANDS if command.keys}
        for thread in threads:
            thread.start()
        try:
            chromium = ChromiumReviewer(work, len(papers), page, keys, readings.read_when_due)
            while not work.is_over:
                chromium.review()
        except Exception as error:
            work.failed.append(error)
        for thread in threads:
            thread.join()
        if work.failed:
            raise RuntimeError("somebody could not go on") from work.failed[0]
        found = readings.minutes, readings.cursor_ms
        print(f"{len(work.stuck)} times somebody was stuck", flush=True)
        browser.close()
    return found


def section(minutes: Sequence[Minute], cursor_ms: Sequence[float]) -> str:
    """A table by ten minutes, and what the memory grew by since the first ten."""
    rows, last = [], minutes[-1].at_s
    for since in np.arange(0, last, SETTLED_S):
        of = [m for m in minutes if since <= m.at_s < since + SETTLED_S]
        rows.append(
            f"| {since / 60:.0f} to {min(since + SETTLED_S, last) / 60:.0f} | {of[-1].finished} | "
            f"{np.median([m.server_mb for m in of]):.0f} | {max(m.server_mb for m in of):.0f} | "
            f"{np.median([m.heap_mb for m in of if m.heap_mb]):.1f} |"
        )
    return "\n".join(
        [
            "| minutes | trials finished by then | server, median [MB] | most | page's heap, median [MB] |",
            "|---|---|---|---|---|",
            *rows,
            "",
            f"From a key to the painted cursor in Chromium, {len(cursor_ms)} times: median "
            f"{np.median(cursor_ms):.0f} ms, 95th percentile {np.percentile(cursor_ms, 95):.0f} ms.",
        ]
    )


def main() -> None:
    """Print the section, or be the server."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=__doc__)
    parser.add_argument("root", type=Path)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--times-over", type=int, default=TIMES_OVER)
    parser.add_argument("--serve", action="store_true", help="be the server of the folder")
    given = parser.parse_args()
    if given.serve:
        faulthandler.register(signal.SIGUSR1)  # says where each thread is
        app = start(given.root, port=0)
        print(app.server.get_port(), flush=True)
        try:
            until_told_to_end()
        finally:
            app.close()
        return
    with copies(given.root, given.times_over) as root:
        print(section(*worked(root, 60 * given.minutes)))


if __name__ == "__main__":
    main()
