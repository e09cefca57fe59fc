"""How soon the queue of 500 trials is on the screen: `python -m benchmarks.queue_page`.

Folders as an app finds them, made by hand: small recordings, the figures of a fit, proposals, and for some a
review with assignments and comments. Nothing is solved, and no trial of them can be opened. Chromium runs
headless on this machine; a time ends when the browser has painted.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from addb_viewer.app.app import start
from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, SetActivity, SetStatus, Status
from annotations.work import Assign, Comment
from solver.contact.proposals import Proposal
from solver.fitting.results.codec import Encoder
from tests.addb_viewer.chromium import installed

TRIALS, FRAMES, RATE = 500, 400, 100
PEOPLE = ("Anna", "Ben", "Chen")
READY_MS = 60_000
LIMIT_PX = 30_000  # scrolled through
FLAGS = ["--no-sandbox", "--disable-dev-shm-usage"]


def write_root(root: Path, trials: int = TRIALS, seed: int = 1) -> None:
    """Make the folders: two in three fitted, one in three reviewed.

    Args:
        root: not there yet.
        trials: how many; each is a subject of its own, which is the worst case.
        seed: of the synthetic figures.
    """
    rng = np.random.default_rng(seed)
    for number in range(trials):
        folder = root / f"study {number // 100 + 1}" / f"S{number:04d}"
        folder.mkdir(parents=True)
        (folder / "walk.trc").write_text(_markers())
        (folder / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
        if number % 3:
            _write_fit(folder / "results", rng)
        if number % 3 == 1:
            _write_review(folder, number, rng)


def _markers() -> str:
    names = ("HEAD", "RASI", "LASI", "RHEEL", "LHEEL")
    lines = [
        "PathFileType\t4\t(X/Y/Z)\twalk.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"{RATE}\t{RATE}\t10\t{len(names)}\tm",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(names) + 1)),
    ]
    values = "\t".join(["0.0\t1.0\t0.0"] * len(names))
    return "\n".join([*lines, *(f"{k + 1}\t{k / RATE}\t{values}" for k in range(10))]) + "\n"


def _write_fit(results: Path, rng: np.random.Generator) -> None:
    """Figures as `fit --json` has them, and proposals as the fit's file keeps them."""
    lost, force, moment = int(rng.integers(0, 150)), float(rng.gamma(2, 0.02)), float(rng.gamma(2, 0.003))
    places = sorted(int(place) for place in rng.integers(0, FRAMES - 40, rng.integers(0, 4)))
    proposals = tuple(
        Proposal((place, place + 30), "calcn_r", "notOverForcePlate", float(rng.uniform(0.3, 1)), {})
        for place in places
    )
    encoder = Encoder(results)
    tree = {"fields": {"capture": {"fields": {"name": "walk"}}, "proposals": encoder.encode(proposals)}}
    (results / "solve-1" / "trials").mkdir(parents=True)
    np.savez(results / "solve-1" / "trials" / "walk.npz", tree=np.array(json.dumps(tree)), **encoder.arrays)
    trial = {
        "name": "walk",
        "frames": FRAMES,
        "rate_hz": RATE,
        "frames_with_force_used": FRAMES - lost,
        "frames_used_ranges": [[lost // 2, FRAMES - (lost - lost // 2)]],
        "mask_source": str(rng.choice(["proposals", "review + proposals", "review.json", "none"])),
        "linear_residual": {"rms_BW": force},
        "angular_residual": {"rms_BWh": moment},
    }
    head = {"trials": [trial], "files": ["fit.json", "solve-1/trials/walk.npz"]}
    (results / "fit.json").write_text(json.dumps(head))


def _write_review(folder: Path, number: int, rng: np.random.Generator) -> None:
    first, second = rng.permutation(PEOPLE)[:2]
    with open_log(folder) as log:
        log.append("walk", FlagRange(100, 150, "notOverForcePlate", "calcn_r"), str(first))
        log.append("walk", SetActivity(0, FRAMES, str(rng.choice(["walk", "run", "jump"]))), str(first))
        if number % 7 == 0:
            log.append("walk", FlagRange(120, 150, "forceDiscrepancy", "calcn_r"), str(second))
        if number % 2:
            log.append("walk", SetStatus(Status.FINISHED), str(first))
        if number % 5 == 0:
            log.work.append(["walk"], Assign(str(second)), str(first))
            log.work.append(["walk"], Comment("Is that a stumble?", frame=120), str(first))


def measured(root: Path) -> dict[str, float]:
    """Times [ms] and the page's heap [MB]."""
    began = time.perf_counter()
    app = start(root, port=0)
    found = {"the app starts, all rows read": 1e3 * (time.perf_counter() - began)}
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=installed(), args=FLAGS)
            page = browser.new_page(viewport={"width": 1920, "height": 1080})
            page.set_default_timeout(READY_MS)
            address = f"http://127.0.0.1:{app.server.get_port()}/queue"
            for visit in ("first", "second"):
                began = time.perf_counter()
                page.goto(address)
                _painted(page)
                found[f"{visit} visit, rows painted"] = 1e3 * (time.perf_counter() - began)
            found |= _acts(page)
            browser.close()
    finally:
        app.close()
    return found


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
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=TRIALS)
    parser.add_argument("--root", type=Path, help="folder to keep, made where it is missing")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        root = options.root or Path(scratch) / "root"
        if not root.exists():
            write_root(root, options.trials)
        for words, value in measured(root).items():
            print(f"{words}: {value:.0f}" if value >= 10 else f"{words}: {value:.1f}")


if __name__ == "__main__":
    main()
