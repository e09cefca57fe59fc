"""How soon a trial of a root of 500 is on the screen: `python -m benchmarks.opening_trials ROOT`.

The trials of `benchmarks.review_by_key ROOT --only-fit`, each subject many times over, are opened by a
browser without a picture: the next of the queue by *T*, after some seconds on the one before it; and by
address, in a browser that has just come, one that nobody has opened yet. A time ends when the page has been
told all that its timeline and bar show; the scene is then on its way.
"""

import argparse
import json
import os
import random
import shutil
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from addb_viewer.app.queue.controller import READ_S
from benchmarks.processes import running
from tests.addb_viewer.app.paper_browser import PaperBrowser

TIMES_OVER = 28  # each subject
TIMES = 20  # of each kind
LOOKED_AT_S = 6.0  # before the next one
T = "Finish the trial, go to the next"


def write_root(source: Path, root: Path, times_over: int) -> list[tuple[str, str]]:
    """Each subject some times over, by hard links; subject and trial of each."""
    trials = [(subject, trial) for subject, trial, _ in json.loads((source / "truth.json").read_text())]
    ignored = shutil.ignore_patterns("annotations.*", "solves")
    for subject in dict.fromkeys(subject for subject, _ in trials):
        for k in range(times_over):
            shutil.copytree(
                source / subject, root / f"{subject}-{k + 1}", ignore=ignored, copy_function=os.link
            )
    return [(f"{subject}-{k + 1}", trial) for subject, trial in trials for k in range(times_over)]


def opened_by_t(port: int) -> list[float]:
    """Seconds from the *T* that finishes to the next trial."""
    browser, found = PaperBrowser(port, name="Ada"), []
    try:
        browser.until(lambda: _place(browser), "the first trial")
        while len(found) < TIMES:
            time.sleep(LOOKED_AT_S)
            before, told = _place(browser), len(browser.notices)
            began = time.perf_counter()
            browser.press(T)
            browser.until(
                lambda before=before, told=told: _is_elsewhere(browser, before) or _doubts(browser, told),
                "the next trial",
            )
            if _doubts(browser, told):
                time.sleep(READ_S)
                began = time.perf_counter()
                browser.press(T)
                browser.until(lambda before=before: _is_elsewhere(browser, before), "the next trial")
            found.append(time.perf_counter() - began)
    finally:
        browser.close()
    return found


def opened_cold(port: int, trials: Sequence[tuple[str, str]]) -> list[float]:
    """Seconds from a browser's coming, with the address of a trial, to that trial."""
    found = []
    for subject, trial in trials:
        began = time.perf_counter()
        browser = PaperBrowser(port, name="Ben", at=[subject, trial])
        try:
            browser.until(partial(_is_at, browser, subject, trial), f"{subject}/{trial}")
            found.append(time.perf_counter() - began)
        finally:
            browser.close()
    return found


def _doubts(browser: PaperBrowser, told: int) -> bool:
    """Whether T has said what speaks against finishing, after so many notices."""
    return any(title.startswith("T again") for title, _ in browser.notices[told:])


def _place(browser: PaperBrowser) -> str:
    return str(browser.bar.get("place", ""))


def _is_elsewhere(browser: PaperBrowser, before: str) -> bool:
    return _place(browser) not in ("", before) and _draws(browser, _place(browser).split(" · ")[-1])


def _is_at(browser: PaperBrowser, subject: str, trial: str) -> bool:
    return subject in _place(browser) and _draws(browser, trial)


def _draws(browser: PaperBrowser, trial: str) -> bool:
    return bool(browser.trial and browser.trial["trial"] == trial and browser.row_blocks())


def _row(words: str, of: Sequence[float]) -> str:
    return f"| {words} | {len(of)} | {np.median(of):.2f} | {np.percentile(of, 95):.2f} | {max(of):.2f} |"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.opening_trials", description=__doc__)
    parser.add_argument("root", type=Path)
    parser.add_argument("--times-over", type=int, default=TIMES_OVER)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.root.parent) as scratch:
        trials = write_root(given.root, Path(scratch), given.times_over)
        with running("benchmarks.working_hour", "--serve", scratch) as (_, said):
            next_s = opened_by_t(int(said))
            cold_s = opened_cold(int(said), random.Random(1).sample(trials, TIMES))
    print(f"| of {len(trials)} trials | times | median [s] | 95th percentile [s] | longest [s] |")
    print("|---|---|---|---|---|")
    print(_row("the next trial, by *T*", next_s))
    print(_row("any other, cold", cold_s))


if __name__ == "__main__":
    main()
