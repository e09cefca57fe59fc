"""An hour's work of four reviewers on one server: does its memory grow, and that of a page?

Three reviewers are browsers without a picture: they decide proposals at random (with a seed), flag, undo,
play, ask what if, solve now and then, finish, and go on to the next trial. The fourth is Chromium, which
steps, plays and goes on by keys, from tab to tab. Every minute the server's resident memory is read,
Chromium's heap after its garbage is gone, and how long it takes from a key to the painted cursor.
"""

import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from playwright.sync_api import CDPSession, Page, sync_playwright

from addb_viewer.app.queue.queue_controller import READ_S
from addb_viewer.app.shell.commands import COMMANDS
from benchmarks.markdown import table
from benchmarks.recordings import data_folder
from benchmarks.speed.app_keys import MODULE, copies
from benchmarks.speed.measuring import resident_megabytes, running
from tests.addb_viewer.app.paper_browser import PaperBrowser
from tests.addb_viewer.app.ten_trials import write_ten_trials
from tests.addb_viewer.chromium import FLAGS, installed, remembering

PEOPLE = ("Anna", "Ben", "Chen", "Dora")  # the last one has Chromium
BETWEEN_KEYS_S = 1.0
PLAYED_S = 6.0
OPENED_S = 3.0  # for the next trial; then the key is pressed again
MOST_TIMES_T = 15
SOLVED_EVERY_S = 600.0  # by each person
SETTLED_S = 600.0  # from when on memory is to stay
EVERY_S = 60.0
STEPS = 10  # whose cursor is timed, each minute
LOADED_MS = 120_000
T, NEXT, NO = "Finish the trial, go to the next", "Next proposal or flagged range", "No, to the question"
ACCEPT, REJECT, UNDO, REDO = "Accept the proposal", "Reject the proposal", "Undo", "Redo"
WORST, FLAG, WHAT_IF = "Worst frame that counts", "Flag: force wrong", "What if this range were flipped"
KEEP, DISCARD = "Keep the new solve (so does Y)", "Discard the new solve"
TABS = ("Review", "Solve", "Curves", "Diagnosis")

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


@dataclass(frozen=True)
class Minute:
    """What was read at one time."""

    at_s: float  # since all began to work
    server_mb: float
    heap_mb: float  # of Chromium's page
    finished: int  # trials, by all


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


class Reviewer:
    """One who works by command, in a browser without a picture."""

    def __init__(self, work: Work, seed: int, port: int, name: str) -> None:
        self.work, self.random, self.solved_at = work, random.Random(seed), time.monotonic()
        self.name = name
        self.browser = PaperBrowser(port, name=name)
        self.browser.until(self.place, "the first trial")

    def place(self) -> str:
        """The trial on the screen, by its words in the bar."""
        return str(self.browser.bar.get("place", ""))

    def work_on(self) -> None:
        """Until the hour is over."""
        try:
            while not self.work.is_over:
                self.review()
        except Exception as error:  # told by the one who reads the memory
            self.work.failed.append(error)
        finally:
            self.browser.close()

    def do(self, *labels: str) -> None:
        """Some keys, one after the other."""
        for label in labels:
            self.browser.press(label)
            self.work.acts += 1
            time.sleep(BETWEEN_KEYS_S)

    def review(self) -> None:
        """The trial on the screen, up to the next one."""
        place, choose = self.place(), self.random
        first = str(self.browser.bar.get("open") or "").split(" ", maxsplit=1)[0]
        for _ in range(min(int(first) if first.isdigit() else 0, 8)):
            self.do(NEXT, choose.choice((ACCEPT, REJECT)))
        self.do("Play or pause")
        time.sleep(PLAYED_S)
        self.do("Stop", WORST, FLAG, NO, *choose.choice(((UNDO,), (UNDO, REDO), ())))
        self.do(*["One frame on"] * 5, *["1 s on"] * 2, "First frame")
        if choose.random() < 0.2:
            self.do(NEXT, WHAT_IF)
        if time.monotonic() - self.solved_at > SOLVED_EVERY_S:
            self.solved_at = time.monotonic()
            self.do("Solve again")
        if self._waits():
            self.do(choose.choice((KEEP, DISCARD)))
        for times in range(1, MOST_TIMES_T + 1):  # the first one may only say what speaks against it
            self.do(T)
            end = time.monotonic() + READ_S + OPENED_S
            while self.place() == place and time.monotonic() < end:
                time.sleep(0.1)
            if self.place() != place:
                self.work.finished += 1
                return
            if times % 3 == 0:  # a question may keep T away; no to it makes T say again what it said
                self.do(NO, *([DISCARD] if self._waits() else []))
        self.work.stuck.append(f"T does not leave {place}: {self.browser.notices[-MOST_TIMES_T:]}")
        print(self.work.stuck[-1], flush=True)
        self.work.server.send_signal(signal.SIGUSR1)

    def _waits(self) -> bool:
        """Whether a new solve of one's own waits; about others' the app asks whether that is meant."""
        told = str((self.browser.bar.get("solve") or {}).get("text", ""))
        return told.startswith("New solve") and told.endswith(f"for {self.name}")


class Watcher:
    """Chromium, which works by keys, and reads memory and the cursor's times once a minute."""

    def __init__(self, work: Work, page: Page, developer: CDPSession) -> None:
        self.minutes: list[Minute] = []
        self.cursor_ms: list[float] = []  # from a key to the painted cursor
        self.work, self._page, self._developer = work, page, developer
        self._keys = {command.label: command.keys[0] for command in COMMANDS if command.keys}
        self._began = self._due = time.monotonic()

    def work_on(self) -> None:
        """From tab to tab and trial to trial until the hour is over."""
        turn = 0
        while not self.work.is_over:
            self._page.get_by_role("tab", name=TABS[turn % len(TABS)], exact=True).click()
            for label in ("Play or pause", "1 s on", "Stop", WORST, "One frame on", "First frame", T, T, NO):
                self._page.keyboard.press(self._keys[label])
                self.work.acts += 1
                self._page.wait_for_timeout(1e3 * BETWEEN_KEYS_S)
                self._read_when_due()
            turn += 1

    def _read_when_due(self) -> None:
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
        memory = resident_megabytes(self.work.server.pid)
        self.minutes.append(Minute(time.monotonic() - self._began, memory, heap, self.work.finished))
        print(self.minutes[-1], f"{self.work.acts} acts", flush=True)


def hour_section(folder: Path, minutes: float, times_over: int) -> str:
    """Four people at work on many trials.

    Args:
        folder: for the trials; a fit that is there is not made again.
        minutes: how long they work.
        times_over: how often each of the five subjects is there.
    """
    trials = folder / "trials"
    if not trials.is_dir():
        draft = folder / "trials.draft"
        shutil.rmtree(draft, ignore_errors=True)
        write_ten_trials(data_folder(), draft)
        draft.rename(trials)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:  # on the disk, as recordings are
        for subject in sorted(trials.iterdir()):
            copies(subject, Path(scratch), times_over)
        watcher = worked(Path(scratch), 60 * minutes)
    return _hour_table(watcher.minutes, watcher.cursor_ms, len(watcher.work.stuck))


def worked(root: Path, seconds: float) -> Watcher:
    """What was read while the four worked.

    Args:
        root: of the subjects; is written to.
        seconds: how long.

    Raises:
        RuntimeError: somebody could not go on.
    """
    with running(MODULE, "serve", str(root)) as (server, said), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=installed(), args=FLAGS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(LOADED_MS)
        page.add_init_script(remembering(PEOPLE[-1]))
        page.add_init_script(CURSOR)
        page.goto(f"http://127.0.0.1:{int(said)}")
        page.locator("#addb-bar b").first.wait_for()
        page.evaluate("new Promise((done) => window.addb.on('keys', () => done(true)))")
        page.locator("#addb-rows .addb-row").first.wait_for()
        developer = page.context.new_cdp_session(page)
        developer.send("Performance.enable")
        work = Work(server, time.monotonic() + seconds)
        reviewers = [Reviewer(work, k, int(said), name) for k, name in enumerate(PEOPLE[:-1])]
        threads = [threading.Thread(target=one.work_on) for one in reviewers]
        watcher = Watcher(work, page, developer)
        for thread in threads:
            thread.start()
        try:
            watcher.work_on()
        except Exception as error:
            work.failed.append(error)
        for thread in threads:
            thread.join()
        browser.close()
        if work.failed:
            raise RuntimeError("somebody could not go on") from work.failed[0]
    return watcher


def _hour_table(minutes: Sequence[Minute], cursor_ms: Sequence[float], stuck: int) -> str:
    """By ten minutes."""
    rows, last = [], minutes[-1].at_s
    for since in np.arange(0, last + 1.0, SETTLED_S):
        of = [m for m in minutes if since <= m.at_s < since + SETTLED_S]
        if not of:
            continue
        server, heap = [m.server_mb for m in of], [m.heap_mb for m in of]
        until = min(since + SETTLED_S, last) / 60
        row = [f"{since / 60:.0f} to {until:.0f}", of[-1].finished, f"{np.median(server):.0f}"]
        rows.append([*row, f"{max(server):.0f}", f"{np.median(heap):.1f}"])
    head = ["minutes", "trials finished by then", "server, median [MB]", "most", "page's heap, median [MB]"]
    median, most = np.median(cursor_ms), np.percentile(cursor_ms, 95)
    return (
        f"{table(head, rows)}\n\nFrom a key to the painted cursor in Chromium, {len(cursor_ms)} times: "
        f"median {median:.0f} ms, 95th\npercentile {most:.0f} ms. Somebody was stuck {stuck} times."
    )
