"""Forces from motion alone, synthetic and recorded: `python -m benchmarks.forces_from_motion`.

Synthetic persons, each with a body and a gait of their own, become a release; a fifth of them is tested, a
fifth chooses, the others train. Recordings of `benchmarks.truth.recorded`, one folder a person, get their
activity as a label and become another one; each person is tested once, all others train, from random weights
and from those learnt on the synthetic persons. Picks up where it was stopped, as long as --out is the same.
Writes BENCHMARK.md and the sweep's figure.
"""

import argparse
import csv
import json
import os
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from typer.testing import CliRunner

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.results import Result, read_results
from addb_viewer.benchmark.tables import JUDGED, markdown, ranked, with_best_baseline
from addb_viewer.commands.cli import app
from addb_viewer.dataset.synthesis.corpus import CorpusOptions, synthesize
from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from solver.capture.atomic import write_whole
from solver.capture.subject.subject import open_subject
from solver.capture.trial import read_trial
from solver.fitting.settings import Settings

PAGE = Path(__file__).with_name("BENCHMARK.md")
FIGURE = "benchmark_sweep.svg"
OURS = "fit-from-angles"
WHY_BEHIND = (
    "The smoothing's cutoff is chosen by other persons, and most of these walk: landings and sprints have "
    "faster forces than it lets pass. In sitting and rising a chair carries what no foot does, and no entry "
    "knows of it. One or two persons tell little; the intervals are those of the tables above."
)
WORDS = {"sit": "sit-to-stand", "sprint": "run"}  # the release's words for the bench's
LEFT_OUT = {
    "anomalies/tiziana2019_lencioni": "a fault is known in it",
    "c3d_lab_trials/opensim_core": "its markers do not show the landing's forces, with any method of ours",
    "overground_camargo2021_AB06": "its markers are on legs and pelvis alone",
    "opencap_reviewed": "may be a person of the other OpenCap folders",
}
PERSONS = 100
FOLDS, TESTED = 5, "fold-1"  # of the synthetic persons
TERMS = ("--unreviewed", "--licence", "CC0-1.0", "--consent", "public", "--workers", "1")
TIMES = "times.json"


@dataclass(frozen=True)
class Entry:
    """A predictor with its options."""

    result: str  # its name in tables
    name: str
    options: tuple[str, ...] = ()


LEARNT = ("mlp", "groundlinknet")
ENTRIES = (
    Entry("analytical", "analytical"),
    *(Entry(name, name) for c in (6, 12, 30) for name in (f"analytical-{c}Hz", f"analytical-{c}Hz-soles")),
    Entry("fit-from-angles", "fit-from-angles"),
    Entry("fit-from-markers", "fit-from-markers"),
    Entry("regression", str(Path(__file__).parents[1] / "examples" / "08_own_predictor.py") + ":Regression"),
    *(Entry(name, name) for name in LEARNT),
    *(Entry(f"{name}-wide", name, ("--features", "wide")) for name in LEARNT),
)
STARTED = tuple(Entry(f"{name}-started", name) for name in LEARNT)


def synthetic(root: Path, persons: int) -> None:
    """Four short recordings of each: walks, runs, squats, standing, as their laboratory has them.

    Args:
        root: of their folders; what is there stays.
        persons: how many.
    """
    if root.exists():
        return
    draft = root.with_name(f"{root.name}.draft")
    for left in (draft, draft.with_name(f"{draft.name}.truth")):
        shutil.rmtree(left, ignore_errors=True)
    activities = ("walk", "run", "squat", "stand")
    synthesize(
        draft,
        CorpusOptions(
            persons, 31, False, actors=None, activities=activities, longest_s=1.1, takes=2, faults=False
        ),
        print,
    )
    draft.rename(root)


def labelled(root: Path) -> None:
    """Copies of the recordings with their activities as labels.

    Args:
        root: of the copies; those that are there stay.
    """
    for folder, activities in ACTIVITY.items():
        copy = root / folder.replace("/", "_")
        if folder in LEFT_OUT or copy.exists():
            continue
        shutil.copytree(data_folder() / folder, copy)
        table = copy / "activities.csv"
        with table.open("w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["trial", "start", "end", "activity"])
            for files in open_subject(copy).trials:
                if files.name in activities:
                    word = activities[files.name]
                    frames = read_trial(files, Settings().reading).markers.frames
                    rows.writerow([files.name, 0, frames, WORDS.get(word, word)])
        command("label", str(copy), str(table), "--author", "bench")


def command(*words: str) -> None:
    """A command of ours in this process.

    Args:
        words: of the command.
    """
    print("addb-viewer", *words, flush=True)
    done = CliRunner().invoke(app, list(words), catch_exceptions=False)
    print(done.output, flush=True)
    if done.exit_code:
        raise SystemExit(done.exit_code)


def main() -> None:
    """Build, split, evaluate, sweep, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/benchmark"))
    parser.add_argument("--persons", type=int, default=PERSONS, help="synthetic ones; 0: none")
    parser.add_argument("--without", nargs="*", default=[], help="predictors that are left out")
    asked = parser.parse_args()
    out = asked.out.resolve()
    entries = [entry for entry in ENTRIES if entry.result not in asked.without]
    made, real = out / "synthetic", out / "real"
    if asked.persons:
        if not _built(made):
            synthetic(made / "corpus", asked.persons)
            command("dataset", "build", str(made / "corpus"), "--out", str(made / "release"), *TERMS)
        command("dataset", "split", str(made / "release"), "--kfold", str(FOLDS), "--name", "persons")
        evaluated(made, entries, TESTED)
    labelled(out / "recordings")
    if not _built(real):
        terms = (*TERMS, "--source", "real")
        command("dataset", "build", str(out / "recordings"), "--out", str(real / "release"), *terms)
    command("dataset", "split", str(real / "release"), "--leave-one-person-out", "--name", "persons")
    start = ("--start-from", str(made / "results"))
    wanted = [one for one in STARTED if asked.persons and one.result not in asked.without]
    started = [replace(one, options=start) for one in wanted]
    evaluated(real, [*entries, *started], "every-fold")
    tested = ["--split", "persons", "--part", "every-fold", "--out", str(real / "results")]
    command("benchmark", "sweep", str(real / "release"), *tested)
    shutil.copyfile(real / "results" / "sweep.svg", PAGE.with_name(FIGURE))
    PAGE.write_text(page(made / "results" if asked.persons else None, real / "results"), encoding="utf-8")


def evaluated(folder: Path, entries: Sequence[Entry], part: str) -> None:
    """Train and evaluate what is not there yet; keep what each took.

    Args:
        folder: with the release; results go beside it.
        entries: which.
        part: of the split that is tested.
    """
    results = folder / "results"
    words = ["--split", "persons", "--part", part, "--out", str(results)]
    for entry in entries:
        if (results / f"{entry.result}.parquet").exists():
            continue
        clock, spent = time.monotonic(), time.process_time()
        release = str(folder / "release")
        command("benchmark", "evaluate", release, "--predictor", entry.name, *words, *entry.options)
        took = {"cpu_s": time.process_time() - spent, "clock_s": time.monotonic() - clock}
        times = _times(results) | {entry.result: took | {"load": os.getloadavg()[0]}}
        write_whole(results / TIMES, json.dumps(times, indent=1))


def page(made: Path | None, real: Path) -> str:
    """The page's text.

    Args:
        made: folder of the evaluations on synthetic persons; None: there are none.
        real: of those on real recordings.
    """
    left = "\n".join(f"- {name}: {why}" for name, why in LEFT_OUT.items())
    found = read_results(real)
    return (
        "# Forces from motion alone\n\n"
        "Made by `python -m benchmarks.forces_from_motion`; [docs/benchmark.md](../docs/benchmark.md) says "
        "what the figures are.\n\n"
        "## Real recordings\n\n"
        "Each person is tested once; networks, cutoffs and standard deviations are learnt or chosen by the "
        f"others. {_started(found)}Three rules of our own entries' division between the feet were kept after "
        "comparisons on these persons: that only soles that move with the ground carry and that pressure "
        "stays under them on seven of the ten, that pressure may spare a sole's rim on all ten (how much is "
        "chosen by the others). The solver's settings come from recordings among these, too: no person here "
        "is fresh, and fresh ones would be the stricter judge.\n\n"
        f"{markdown(ranked(with_best_baseline(found)))}\n"
        "## Where ours is not ahead\n\n"
        f"{behind(found)}\n"
        f"{WHY_BEHIND}\n\n"
        f"{_synthetic(made)}"
        "## The filter\n\n"
        f"![Error of the total force against the filter's cutoff]({FIGURE})\n\n"
        "## Recordings left out\n\n"
        f"{left}\n\n"
        "## What is not measured yet\n\n"
        f"{_lacking(made, real)}\n"
    )


def _synthetic(results: Path | None) -> str:
    if results is None:
        return ""
    return (
        "## Synthetic persons\n\n"
        "Simulated bodies and gaits with simulated markers and plates, fitted as recordings are: our "
        "entries know the laws by which they were simulated, and the networks learnt from persons like those "
        "tested. With a hundred such persons a network with wide inputs predicts forces as well as ours or "
        f"better; none of this says which is best on recordings. {_costs(results)}\n\n"
        f"{markdown(ranked(with_best_baseline(read_results(results))), published=False)}\n"
    )


def _started(results: Sequence[Result]) -> str:
    names = [f"`{one.name}`" for one in results if one.name.endswith("-started")]
    if not names:
        return ""
    return (
        f"{' and '.join(names)} went on from the weights learnt on the synthetic persons below, the other "
        "networks from random ones. "
    )


def _lacking(made: Path | None, real: Path) -> str:
    lines = ["- CUDA; persons whom no choice of ours has seen."]
    persons = 0
    if made is not None:
        manifest = json.loads((made.parent / "release" / "manifest.json").read_text(encoding="utf-8"))
        persons = manifest["totals"]["persons"]
    if persons < PERSONS:
        there = f"these are {persons}" if persons else "there are none yet"
        lines.append(f"- {PERSONS} synthetic persons, as the command makes by default: {there}.")
    for words, results, entries in (
        ("synthetic persons", made, ENTRIES),
        ("real recordings", real, (*ENTRIES, *STARTED)),
    ):
        known = {one.name for one in read_results(results)} if results else {one.result for one in entries}
        names = [f"`{entry.result}`" for entry in entries if entry.result not in known]
        if names:
            lines.append(f"- On {words}: {', '.join(names)}.")
    without = [
        f"`{one.name}`"
        for one in read_results(real)
        if one.name.startswith(LEARNT) and not average(one.scores, "coverage_95")
    ]
    if without:
        lines.append(f"- Standard deviations of {' and '.join(without)}.")
    return "\n".join(lines)


def _times(results: Path) -> dict[str, dict[str, float]]:
    path = results / TIMES
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _costs(results: Path) -> str:
    times = _times(results)
    cpu, clock = (sum(one[key] for one in times.values()) / 60 for key in ("cpu_s", "clock_s"))
    learnt = ", ".join(f"{name} {times[name]['cpu_s']:.0f} s" for name in times if name.startswith(LEARNT))
    load = max((one["load"] for one in times.values()), default=0.0)
    return (
        f"Training (10 epochs) and evaluation of these {len(times)} entries took {cpu:.1f} CPU minutes on "
        f"one core, {clock:.0f} on the clock with up to {load:.0f} busy processes on {os.cpu_count()} cores; "
        f"of CPU time {learnt}."
    )


def _built(folder: Path) -> bool:
    return (folder / "release" / "manifest.json").exists()


def behind(results: Sequence[Result]) -> str:
    """Activities in which another entry that sees angles has the smaller force error.

    Args:
        results: all of them.
    """
    fair = [one for one in results if not one.sees_markers]
    lines = []
    for activity in sorted({score.activity for score in fair[0].scores}):
        errors = {one.name: average(one.scores, JUDGED, activity) for one in with_best_baseline(fair)}
        means = {name: found.mean for name, found in errors.items() if found}
        best = min(means, key=lambda name: means[name])
        if best != OURS:
            who = f"persons: {errors[OURS].persons}"
            lines.append(
                f"- {activity} ({who}): {best} {means[best]:.3f} N/kg, {OURS} {means[OURS]:.3f} N/kg"
            )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
