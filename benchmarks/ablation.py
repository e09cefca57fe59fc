"""What hidden forces cost, on real recordings and on a long synthetic walk, into benchmarks/ABLATION.md.

    python -m benchmarks.ablation [--only NAME] [--repetitions 10] [--minutes 60] [--keep FOLDER]

Every run is kept in FOLDER as soon as it is done, and made only once: a stopped program goes on where it was.
Runs of other recordings, settings or versions are not taken up; remove FOLDER after changes of the solver.
"""

import argparse
import hashlib
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from addb_viewer.commands.ablation_setup import Experiment, choices_of, experiment_on
from addb_viewer.commands.ablation_table import run_as_json
from addb_viewer.jobs.solving import Job, job_for
from benchmarks.ablation_page import Rows, page
from benchmarks.long_walk import write_long_walk
from benchmarks.recordings import data_folder
from solver.common.progress import silent
from solver.dynamics.cross_validation.ablation import ablate
from solver.dynamics.cross_validation.hidden_steps import Step
from solver.fitting.provenance import provenance_of
from solver.fitting.results.store import write_json
from solver.fitting.settings import as_dict

PAGE = Path(__file__).parent / "ABLATION.md"
KEPT = Path("build/ablation")
RECORDINGS = ("walk_treadmill_stepwidth", "run_treadmill_hamner2013_subject04")
LONG_WALK, LONG_WALK_S = "long_walk", 50.0
FRACTIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
SEED = 1


@dataclass
class Ledger:
    """Runs of one trial, by the numbers of the hidden steps; in a file that grows with each."""

    file: Path
    inputs: str
    about: dict[str, object]
    runs: dict[str, dict[str, Any]]

    @classmethod
    def opened(cls, file: Path, job: Job, experiment: Experiment) -> "Ledger":
        """With the runs of an earlier program on the same inputs."""
        inputs = _fingerprint(job)
        kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        same = kept.get("inputs") == inputs and kept.get("about") == experiment.about()
        return cls(file, inputs, experiment.about(), kept["runs"] if same else {})

    def add(self, key: str, run: dict[str, Any]) -> None:
        """Keep a run."""
        self.runs[key] = run
        write_json(self.file, {"inputs": self.inputs, "about": self.about, "runs": self.runs})


def _fingerprint(job: Job) -> str:
    made_from = (provenance_of(job.subject, job.subject.trials, job.reviews), as_dict(job.settings))
    return hashlib.sha256(json.dumps(made_from, default=str).encode()).hexdigest()


def missing_runs(
    experiment: Experiment, choices: dict[str, list[list[Step]]], ledger: Ledger, deadline: float
) -> None:
    """Make what the ledger lacks, a choice of each condition in turn, until so much CPU time is spent [s]."""
    wanted: dict[str, list[Step]] = {}
    for rank in range(max(len(several) for several in choices.values())):
        for several in choices.values():
            if rank < len(several):
                wanted[key_of(several[rank], experiment.steps)] = several[rank]
    todo = {key: steps for key, steps in wanted.items() if key not in ledger.runs}
    if not todo or time.process_time() > deadline:
        return
    done = ablate(
        experiment.trial, [experiment.hidden(steps) for steps in todo.values()], experiment.settings, silent
    )
    for key, repetition in zip(todo, done, strict=True):
        ledger.add(key, run_as_json(repetition))
        print(f"{experiment.name}: hidden {key}", flush=True)
        if time.process_time() > deadline:
            return


def key_of(hidden: list[Step], steps: list[Step]) -> str:
    """The hidden steps' numbers, by which a run is known whatever condition it belongs to."""
    return " ".join(str(i) for i in sorted(steps.index(step) for step in hidden))


def rows_of(choices: dict[str, list[list[Step]]], steps: list[Step], ledger: Ledger) -> list[Rows]:
    """Runs by condition; conditions that share all of their runs, in one."""
    found: dict[tuple[str, ...], Rows] = {}
    for name, several in choices.items():
        keys = tuple(sorted(key_of(hidden, steps) for hidden in several))
        runs = [ledger.runs[key] for key in keys if key in ledger.runs]
        if runs:
            names = (*found[keys].names, name) if keys in found else (name,)
            found[keys] = Rows(names, len(several[0]), len(several), runs)
    return list(found.values())


def _folders(only: str, keep: Path) -> Iterator[tuple[str, Path]]:
    for name in RECORDINGS:
        if only in name:
            yield name, data_folder() / name
    if only in LONG_WALK:
        folder = keep / f"{LONG_WALK}_{LONG_WALK_S:g}s"
        if not folder.exists():
            write_long_walk(folder, LONG_WALK_S, np.random.default_rng(SEED))
        yield LONG_WALK, folder


def main() -> None:
    """Make what is missing, and write the page."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.ablation", description=__doc__)
    arguments.add_argument("--only", default="", help="part of a recording's name; the page is not written")
    arguments.add_argument("--repetitions", type=int, default=10, help="choices of hidden steps per fraction")
    arguments.add_argument("--minutes", type=float, default=60.0, help="CPU time after which to stop")
    arguments.add_argument("--keep", type=Path, default=KEPT, help="where runs are kept")
    chosen = arguments.parse_args()
    chosen.keep.mkdir(parents=True, exist_ok=True)
    sections = []
    for name, folder in _folders(chosen.only, chosen.keep):
        job = job_for(folder)
        experiment = experiment_on(job, silent)
        choices = choices_of(experiment.steps, FRACTIONS, chosen.repetitions, SEED)
        ledger = Ledger.opened(chosen.keep / f"{name}.json", job, experiment)
        missing_runs(experiment, choices, ledger, 60 * chosen.minutes)
        sections.append((name, ledger.about, rows_of(choices, experiment.steps, ledger)))
    written = page(
        sections, f"{date.today()}, `python -m benchmarks.ablation --repetitions {chosen.repetitions}`"
    )
    if chosen.only:
        print(written)
    else:
        PAGE.write_text(written, encoding="utf-8")


if __name__ == "__main__":
    main()
