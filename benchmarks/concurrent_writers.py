"""Two programs that change one results folder at once: is every result that was reported kept, and whole?

    python -m benchmarks.concurrent_writers [--pairs 200] [--fits 5] [--seed N]

Of a pair, each writer is a process of its own: `fit` with a solve that takes no time, the app's *Keep*, or
`accept`. Before each step on the disk it yields for a random time, so that the other one comes between. A
third process reads the fit all the while. The pairs of `--fits` are whole fits of a real recording, in two
terminals.
"""

import argparse
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from addb_viewer.jobs import solving
from addb_viewer.jobs.stored_solves import add, keep, stored_solves
from solver.capture.atomic import DRAFT
from solver.capture.capture import Subject
from solver.capture.subject.subject import open_subject
from solver.common.errors import SolverError
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.fit import Fit
from solver.fitting.pipeline import solve
from solver.fitting.results import extension_log
from solver.fitting.results.store import load_fit, save_fit
from solver.fitting.results.writing import LOCK
from solver.fitting.settings import Settings

KINDS = ("fit", "keep", "accept")
YIELDS_S = 0.003  # mean of what a step waits; a step itself takes less
STEPS = ("mkdir", "rename", "replace", "unlink", "open", "rmdir", "scandir", "chmod")
RECORDING = "walk_treadmill_stepwidth"
FORKS = multiprocessing.get_context("fork")  # a writer begins at once, with everything loaded


def faults_of_pair(fit: Fit, kinds: tuple[str, str], seed: int) -> list[str]:
    """Let two writers loose on one folder.

    Args:
        fit: any; each writer keeps it with another mass.
        kinds: what each of them does.
        seed: of the times that they yield.

    Returns:
        What went wrong, in words; nothing where all is well.
    """
    with tempfile.TemporaryDirectory() as place:
        results = Path(place) / "results"
        save_fit(fit, results)
        masses = (fit.mass_kg + 1.0, fit.mass_kg + 2.0)
        for kind, mass in zip(kinds, masses, strict=True):
            if kind == "keep":
                add(replace(fit, mass_kg=mass), results, by="reviewer", seconds=0.0)
        said: multiprocessing.Queue[tuple[str, str]] = FORKS.Queue()
        end, start = FORKS.Event(), FORKS.Barrier(3)
        solving_at_once = FORKS.Barrier(max(1, kinds.count("fit")))
        writers = [
            FORKS.Process(
                target=_write,
                args=(
                    replace(fit, mass_kg=mass),
                    kind,
                    results,
                    np.random.default_rng([seed, k]),
                    start,
                    said,
                    solving_at_once,
                ),
            )
            for k, (kind, mass) in enumerate(zip(kinds, masses, strict=True))
        ]
        reader = FORKS.Process(target=_read, args=(fit, results, start, end, said))
        for process in (*writers, reader):
            process.start()
        for process in writers:
            process.join()
        end.set()
        reader.join()
        faults = [f"{who}: {fault}" for who, fault in (said.get() for _ in (*writers, reader)) if fault]
        try:
            return faults + _lost(fit, kinds, masses, results)
        except (SolverError, OSError) as error:  # a fit or a decision that cannot be read
            return [*faults, str(error)]


def faults_of_fits(recording: Path) -> list[str]:
    """Let two terminals fit one real recording at once, with settings that differ."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / recording.name
        shutil.copytree(recording, folder)
        other = Path(place) / "other.toml"
        other.write_text("[kinematics]\niterations = 59\n", encoding="utf-8")
        fit = [sys.executable, "-m", "addb_viewer", "fit", str(folder), "--quick"]
        runs = [
            subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            for command in (fit, [*fit, "--settings", str(other)])
        ]
        faults = [run.communicate()[1] for run in runs]
        found = [load_fit(folder / "results", folder)]
        found += [load_fit(one.folder, folder) for one in stored_solves(folder / "results")]
        steps = sorted(one.settings["kinematics"]["iterations"] for one in found)
        if steps != sorted({59, Settings().kinematics.iterations}):
            faults.append(f"fits with these numbers of iterations are kept: {steps}")
        return [fault for fault in (*faults, *_debris(folder / "results")) if fault]


def _write(  # noqa: PLR0917
    fit: Fit, kind: str, results: Path, rng: np.random.Generator, start, said, solving_at_once
) -> None:
    start.wait()
    try:
        _yielding(rng)
        if kind == "fit":
            _fit(fit, results, solving_at_once)
        else:
            {"keep": _keep, "accept": _accept}[kind](fit, results)
    except BaseException:
        said.put((kind, traceback.format_exc()))
    else:
        said.put((kind, ""))


def _read(fit: Fit, results: Path, start, end, said) -> None:
    start.wait()
    try:
        while not end.is_set():
            load_fit(results, fit.subject.folder)
    except BaseException:
        said.put(("reader", traceback.format_exc()))
    else:
        said.put(("reader", ""))


def _yielding(rng: np.random.Generator) -> None:
    """From now on this process waits before each step on the disk."""

    def yields(step: Callable) -> Callable:
        def late(*arguments, **options):
            time.sleep(rng.exponential(YIELDS_S))
            return step(*arguments, **options)

        return late

    for name in STEPS:
        setattr(os, name, yields(getattr(os, name)))


def _fit(fit: Fit, results: Path, solving_at_once) -> None:
    """Both solve before either writes: one that begins after the other has ended rightly takes its place."""

    def computed(*_) -> tuple[Fit, str]:
        solving_at_once.wait()
        return fit, ""

    solving.computed = computed
    job = solving.Job(fit.subject, Settings(), None, results, {})
    solving.solved(job, force=True)


def _keep(fit: Fit, results: Path) -> None:
    own = next(one for one in stored_solves(results) if one.figures["subject"]["mass_kg"] == fit.mass_kg)
    keep(own, results, fit.subject.folder)


def _accept(fit: Fit, results: Path) -> None:
    cause = Cause("plate_gain", "plate 1", {"gain": (fit.mass_kg, 0.1)})
    extension = Extension((cause,), np.zeros(0), np.zeros(0))
    extension_log.accept(results, extension, by=str(fit.mass_kg), made_from={})


def _lost(fit: Fit, kinds: tuple[str, str], masses: tuple[float, float], results: Path) -> list[str]:
    """Which results that were reported are not there, or not whole."""
    folder = fit.subject.folder
    held = [load_fit(results, folder).mass_kg]
    held += [load_fit(one.folder, folder).mass_kg for one in stored_solves(results)]
    decided = [decision.by for decision in extension_log.decisions(results)]
    faults = []
    for kind, mass in zip(kinds, masses, strict=True):
        if kind != "accept" and mass not in held:
            faults.append(f"{kind}: the fit with {mass} kg is lost; there are {held}")
        if kind == "accept" and decided.count(str(mass)) != 1:
            faults.append(f"{kind}: the decision by {mass} is lost; there are {decided}")
    for decision in extension_log.decisions(results):
        name = str(decision.wrenches)
        with np.load(results / name) as stored:
            if decision.by not in str(stored["tree"]):
                faults.append(f"accept: {name} is not what {decision.by} accepted")
    fits = {mass for kind, mass in zip(kinds, masses, strict=True) if kind != "accept"}
    if fits and held[0] not in fits:
        faults.append(f"fit.json holds {held[0]} kg, which nobody put there last")
    return faults + _debris(results)


def _debris(results: Path) -> list[str]:
    left = [path.name for path in results.rglob("*") if path.name.startswith(DRAFT) or path.name == LOCK]
    return [f"left behind: {name}" for name in left]


def main() -> int:
    """Run the pairs, and say how many went wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--fits", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--data", type=Path, default=Path(os.environ.get("ADDB_DATA", "../shared/data")), help="recordings"
    )
    asked = parser.parse_args()
    subject: Subject = open_subject(asked.data / RECORDING)
    alone = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
    fit = solve(subject, alone)
    rng, faults = np.random.default_rng(asked.seed), Counter[str]()
    for k in range(asked.pairs):
        first, second = (KINDS[i] for i in rng.integers(len(KINDS), size=2))
        for fault in faults_of_pair(fit, (first, second), asked.seed + k):
            faults[f"{first}, {second}"] += 1
            print(f"pair {k} ({first}, {second}): {fault}")
    for k in range(asked.fits):
        for fault in faults_of_fits(asked.data / RECORDING):
            faults["fits"] += 1
            print(f"fits {k}: {fault}")
    print(f"{asked.pairs} pairs of writers, {asked.fits} pairs of fits: {sum(faults.values())} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
