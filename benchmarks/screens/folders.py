"""The folders that the pictures are of: the demo's subject, as it is and changed, and a large root."""

import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from addb_viewer.jobs.demo import make_demo
from addb_viewer.jobs.environment import own_process
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.stored_solves import stored_solves
from annotations.events import FlagRange
from benchmarks.queue_page import write_root
from solver.contact.proposals import NOT_OVER_FORCE_PLATE, Proposal
from solver.fitting.results.store import has_fit, load_fit, save_fit

TRIAL, FEET = "walk", ("calcn_r", "calcn_l")
REASONS = (NOT_OVER_FORCE_PLATE, "footContactDetectedButNoForce", "hasInputOutliers", "forceDiscrepancy")
TEN, SURE, EACH_LESS = 10, 0.95, 0.06  # proposals, certainty of the surest, of each next one less
WORKERS = "addb_viewer.app.workers"


def demo(folder: Path) -> None:
    """Fitted and diagnosed: one step finds no plate, and all forces come late."""
    _run("demo", "--no-serve", "--folder", str(folder))


def unfitted(folder: Path, _: Path) -> None:
    make_demo(folder)


def copied(folder: Path, source: Path) -> None:
    shutil.copytree(source, folder)


def with_ten_proposals(folder: Path, source: Path) -> None:
    copied(folder, source)
    fit = load_fit(folder / "results", folder)
    (index,) = (k for k, trial in enumerate(fit.trials) if trial.capture.name == TRIAL)
    frames = len(fit.trials[index].capture.markers.times)
    each = frames // (TEN + 1)
    planted = tuple(
        Proposal(
            (k * each + 4, k * each + 4 + each // 2),
            FEET[k % 2],
            REASONS[k % len(REASONS)],
            SURE - EACH_LESS * k,
            {"missing_N": 400.0 + 10 * k},
        )
        for k in range(TEN)
    )
    trials = list(fit.trials)
    trials[index] = replace(trials[index], proposals=planted)
    save_fit(replace(fit, trials=tuple(trials)), folder / "results")


def with_a_waiting_solve(folder: Path, source: Path) -> None:
    """Solved by the app's own worker after a flag; nobody has decided about it."""
    copied(folder, source)
    with open_log(folder) as log:
        log.append(TRIAL, FlagRange(60, 75, "forceDiscrepancy", FEET[0]), "Ada")
    if not stored_solves(folder / "results"):
        subprocess.run(
            [*own_process(WORKERS), "solve", str(folder), str(folder / "results"), "Ada"], check=True
        )


def with_a_disagreement(folder: Path, source: Path) -> None:
    copied(folder, source)
    with open_log(folder) as log:
        log.append(TRIAL, FlagRange(100, 130, NOT_OVER_FORCE_PLATE, FEET[0]), "Ada")
        log.append(TRIAL, FlagRange(115, 140, "forceDiscrepancy", FEET[0]), "Ben")


def of_500(folder: Path, _: Path) -> None:
    write_root(folder)


MAKERS: Mapping[str, Callable[[Path, Path], None]] = {
    "unfitted": unfitted,
    "fitted": copied,
    "solving": copied,
    "waiting": with_a_waiting_solve,
    "ten proposals": with_ten_proposals,
    "two people": with_a_disagreement,
    "queue": of_500,
}


def folder_of(kind: str, work: Path, source: Path | None = None) -> Path:
    """The folder of a kind, made unless that has been done.

    Args:
        kind: a name of `MAKERS`.
        work: where all of them lie.
        source: of the demo's subject, fitted and diagnosed; None: it is made in `work`.
    """
    folder = work / kind
    if folder.exists():
        return folder
    origin = source or work / "demo"
    if kind not in ("unfitted", "queue") and not has_fit(origin / "results"):
        print("making, fitting and diagnosing the demo", flush=True)
        demo(origin)
    print(f"making the folder '{kind}'", flush=True)
    made = work / f"{kind} (being made)"
    shutil.rmtree(made, ignore_errors=True)
    MAKERS[kind](made, origin)
    made.rename(folder)
    return folder


def _run(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "addb_viewer", *arguments], check=True)
