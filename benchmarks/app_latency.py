"""How long the app takes from a key to its echo: alone, beside four players, beside ten while it solves.

The trial is the demo's walk over and over: 10 000 frames, 60 markers, bones, plates, residuals. The server,
the players and the one whose keys are timed are three processes; a time ends when the message that holds
the echo has arrived and is decoded. What a real browser then takes to paint it is not in it.
"""

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.library import Library, library_of
from addb_viewer.trial_view.replay import MarkerReplay, Replay
from benchmarks.processes import resident_megabytes, running, until_told_to_end
from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.capture.subject.subject import open_subject
from tests.addb_viewer.app.paper_browser import PaperBrowser

MODULE = "benchmarks.app_latency"
FRAMES, MARKERS, TRIALS = 10_000, 60, 10
FEW = 4  # who play at once in a laboratory
TIMES = 40  # of each act
PAUSE_S = 0.05  # between two acts
SETTLE_S = 2.0  # until all play
LENGTH = 40  # frames that are painted at once
MORE_WALKS = 4  # in the subject that is solved meanwhile
EVERY = 97  # frames from one painted range to the next
ASK_AGAIN_S = 3.0  # a trial that is chosen opens sooner


def app_latency_section(demo: Path) -> str:
    """Times and memory as a table and a sentence.

    Args:
        demo: folder of the demo subject with a kept fit; what is recorded goes into a folder beside it.
    """
    with running(MODULE, "serve", str(demo)) as (server, said):
        port, began = int(said), time.perf_counter()
        browser = PaperBrowser(port)
        try:
            _until_frame(browser, 0)
            opened = time.perf_counter() - began
            alone = _times(browser, 30)
            one = resident_megabytes(server.pid)
            with running(MODULE, "play", str(port), str(FEW)):
                time.sleep(SETTLE_S)
                beside_few = _times(browser, 5030)
            with running(MODULE, "play", str(port), str(TRIALS), "--solve"):
                time.sleep(SETTLE_S)
                shared = _times(browser, 10)
                if "so far" not in browser.html():
                    raise RuntimeError("the solve ended before all was timed; take a longer one")
                rate = _pictures_a_second(port)
                ten = resident_megabytes(server.pid)
        finally:
            browser.close()
    rows = "\n".join(
        f"| {act} | {_shown(alone[act])} | {_shown(beside_few[act])} | {_shown(shared[act])} |"
        for act in alone
    )
    return (
        "| median (95th percentile) [ms] | alone | four play | ten play, one solve runs |\n"
        "|---|---|---|---|\n"
        f"{rows}\n\n"
        f"The first picture of a trial is on its way {opened:.1f} s after a browser connects.\n"
        f"Each of the ten gets {rate:.0f} pictures a second. Memory of the server: {one:.0f} MB with one\n"
        f"trial open, {ten:.0f} MB with {TRIALS} trials of {FRAMES} frames and {MARKERS} markers open in\n"
        "eleven browsers."
    )


def _times(browser: PaperBrowser, first: int) -> dict[str, list[float]]:
    """Milliseconds of every act, by its name.

    Args:
        browser: whose keys are timed.
        first: frame of the first range that is painted.
    """
    browser.until(lambda: "worst first" in browser.html(), "the page")
    times: dict[str, list[float]] = {"step": [], "seek": [], "paint": []}
    browser.put("Go to", "5")
    _until_frame(browser, 5)
    for k in range(TIMES):
        there = partial(_is_on, browser, 6 + k)
        times["step"].append(_timed(browser, lambda: browser.press("One frame on"), there, "the next frame"))
    for k in range(TIMES):
        frame = 20 + EVERY * k
        go, there = partial(browser.put, "Go to", str(frame)), partial(_is_on, browser, frame)
        times["seek"].append(_timed(browser, go, there, f"frame {frame}"))
    for k in range(TIMES):
        start, key = first + EVERY * k, ("Flag: force wrong", "Flag: moment wrong")[k % 2]
        browser.put("Go to", f"{start}:{start + LENGTH}")
        _wait(browser, f"Frames {start} to {start + LENGTH - 1}<")
        time.sleep(PAUSE_S)
        painted = partial(_is_painted, browser, start, key.removeprefix("Flag: "))
        times["paint"].append(_timed(browser, partial(browser.press, key), painted, key))
    return times


def _timed(browser: PaperBrowser, act: Callable[[], None], echoed: Callable[[], bool], what: str) -> float:
    start = time.perf_counter()
    act()
    browser.until(echoed, what)
    taken = time.perf_counter() - start
    time.sleep(PAUSE_S)
    return 1e3 * taken


def _until_frame(browser: PaperBrowser, frame: int) -> None:
    browser.until(partial(_is_on, browser, frame), f"frame {frame}")


def _is_on(browser: PaperBrowser, frame: int) -> bool:
    return bool(browser.frame == frame)


def _wait(browser: PaperBrowser, echo: str) -> None:
    browser.until(_says(browser, echo), echo)


def _says(browser: PaperBrowser, echo: str) -> Callable[[], bool]:
    return lambda: echo in browser.html()


def _is_painted(browser: PaperBrowser, start: int, reason: str) -> bool:
    blocks = browser.row_blocks()
    return any((a, b) == (start, start + LENGTH) and told.startswith(reason) for a, b, told in blocks)


def _shown(times: Sequence[float]) -> str:
    return f"{np.median(times):.0f} ({np.percentile(times, 95):.0f})"


def _pictures_a_second(port: int) -> float:
    """What one more player gets."""
    browser = PaperBrowser(port)
    try:
        _until_frame(browser, 0)
        browser.press("Play or pause")
        browser.until(lambda: browser.frame > 0, "playing")
        seen, end = set(), time.monotonic() + SETTLE_S
        while time.monotonic() < end:
            browser.until(lambda: browser.frame not in seen, "the next picture")
            seen.add(browser.frame)
        return len(seen) / SETTLE_S
    finally:
        browser.close()


class LongLibrary(Library):
    """Ten long trials in place of the subject's own."""

    def __init__(self, demo: Library, folder: Path) -> None:
        """Nothing is made before it is looked at.

        Args:
            demo: with the fit that is told over and over.
            folder: of the subject that is solved, and whose review is written.
        """
        names = tuple(f"long walk {k + 1}" for k in range(TRIALS))
        files = tuple(TrialFiles(name, folder / f"{name}.trc") for name in names)
        subject = Subject(folder, files, foot_bodies=demo.subject.foot_bodies)
        super().__init__(subject, meshes=demo.meshes)
        self._short = demo.replay("walk")

    @property
    def trials(self) -> tuple[str, ...]:
        """Names of the long ones."""
        return tuple(files.name for files in self.subject.trials)

    def capture(self, name: str) -> Capture:
        """The markers alone."""
        markers = self.replay(name).markers
        return Capture(name, Markers(markers.names, markers.measured, self._short.rate))

    def _load(self, name: str) -> Replay:
        return _long(self._short, name)


def _long(short: Replay, name: str) -> Replay:
    """A trial over and over, with as many markers as wanted; its contacts are those of the first time."""

    def more(values: Float[np.ndarray, "frames *rest"]) -> Float[np.ndarray, "frames *rest"]:
        return np.resize(values, (FRAMES, *values.shape[1:]))

    def wide(values: Float[np.ndarray, "frames markers 3"]) -> Float[np.ndarray, "frames markers 3"]:
        times = -(-MARKERS // values.shape[1])
        shifted = [values + np.array([0.0, 0.02 * k, 0.0]) for k in range(times)]
        return more(np.concatenate(shifted, axis=1)[:, :MARKERS])

    r = short
    assert r.bodies is not None
    assert r.residual is not None
    assert r.joints is not None
    names = tuple(f"M{k}" for k in range(MARKERS))
    return replace(
        r,
        name=name,
        times=np.arange(FRAMES) / r.rate,
        markers=MarkerReplay(names, wide(r.markers.measured), wide(r.markers.model)),
        plates=tuple(replace(p, force=more(p.force), cop=more(p.cop), foot=more(p.foot)) for p in r.plates),
        bodies=replace(
            r.bodies,
            wxyz=more(r.bodies.wxyz),
            position=more(r.bodies.position),
            forward=None if r.bodies.forward is None else more(r.bodies.forward),
        ),
        residual=replace(
            r.residual,
            force=more(r.residual.force),
            moment=more(r.residual.moment),
            com=more(r.residual.com),
            used=more(r.residual.used),
            counted=None if r.residual.counted is None else more(r.residual.counted),
        ),
        joints=replace(
            r.joints,
            position=more(r.joints.position),
            torque=None if r.joints.torque is None else more(r.joints.torque),
        ),
        required=tuple(replace(d, force=more(d.force), point=more(d.point)) for d in r.required),
    )


def _serve(demo: Path) -> None:
    with tempfile.TemporaryDirectory(dir=demo.parent) as scratch:  # on the disk, as recordings are
        folder = Path(scratch) / "subject"
        _copy_recordings(demo, folder)
        library = LongLibrary(library_of(open_subject(demo)), folder)
        app = ReviewApp(open_server(port=0), TrialQueue.of(library), login="Zoë")
        print(app.server.get_port(), flush=True)
        try:
            until_told_to_end()
        finally:
            app.close()


def _copy_recordings(demo: Path, folder: Path) -> None:
    """Without its fit, and with more walks, so that solving takes its time."""
    shutil.copytree(demo, folder, ignore=shutil.ignore_patterns("results", "annotations.*"))
    for k in range(MORE_WALKS):
        shutil.copytree(demo / "trials" / "walk", folder / "trials" / f"walk-{k}")


def _play(port: int, players: int, solve: bool) -> None:
    browsers = [PaperBrowser(port, name=f"player {k}") for k in range(players)]
    for k, browser in enumerate(browsers):
        browser.until(lambda browser=browser: "worst first" in browser.html(), "the page")
        name = f"long walk {k + 1}"
        _go_to(browser, name)
    if solve:
        browsers[0].press("Solve again")
    for browser in browsers:
        browser.press("Play or pause")
    print("playing", flush=True)
    until_told_to_end()


def _go_to(browser: PaperBrowser, trial: str) -> None:
    """Choose a trial until the page is there: one that has just opened first goes to a trial of its own."""

    def is_there():
        return trial in (browser.memory.get("place") or ())

    for _ in range(10):
        browser.put("Trial", trial)
        asked = time.monotonic()
        browser.until(lambda asked=asked: is_there() or time.monotonic() - asked > ASK_AGAIN_S, trial)
        if is_there():
            return
    raise RuntimeError(f"{trial} was chosen ten times and does not open")


def main() -> None:
    """Print the section, or be one of its processes."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.app_latency", description=__doc__)
    parser.add_argument(
        "what", help="folder of a fitted demo subject; the processes are called by this module"
    )
    parser.add_argument("argument", nargs="?")
    parser.add_argument("players", nargs="?", type=int)
    parser.add_argument("--solve", action="store_true")
    arguments = parser.parse_args()
    if arguments.what == "serve":
        _serve(Path(arguments.argument))
    elif arguments.what == "play":
        _play(int(arguments.argument), arguments.players, arguments.solve)
    else:
        print(app_latency_section(Path(arguments.what)))


if __name__ == "__main__":
    main()
