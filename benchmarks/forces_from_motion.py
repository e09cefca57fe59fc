"""Forces from motion alone on real recordings: `python -m benchmarks.forces_from_motion`.

Recordings of `benchmarks.truth.recorded`, one folder a person, get their activity as a label and become a
release; each person is tested once, all others train. Picks up where it was stopped, as long as --out is the
same. Writes BENCHMARK.md and the sweep's figure.
"""

import argparse
import csv
import shutil
from collections.abc import Sequence
from pathlib import Path

from typer.testing import CliRunner

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.results import Result, read_results
from addb_viewer.benchmark.tables import JUDGED, rendered, with_best_baseline
from addb_viewer.cli import app
from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from solver.capture.subject import open_subject
from solver.capture.trial import read_trial
from solver.settings import Settings

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
PREDICTORS = (
    "analytical",
    *(f"analytical-{cutoff}Hz{rule}" for rule in ("", "-soles") for cutoff in (6, 12, 30)),
    "fit-from-angles",
    "fit-from-markers",
    str(Path(__file__).parents[1] / "examples" / "08_own_predictor.py") + ":Regression",
    "mlp",
    "groundlinknet",
)


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
    parser.add_argument("--without", nargs="*", default=[], help="predictors that are left out")
    asked = parser.parse_args()
    out = asked.out.resolve()
    release, results = out / "release", out / "results"
    labelled(out / "recordings")
    if not (release / "manifest.json").exists():
        terms = ["--unreviewed", "--licence", "unknown", "--consent", "public", "--source", "real"]
        command("dataset", "build", str(out / "recordings"), "--out", str(release), "--workers", "1", *terms)
    command("dataset", "split", str(release), "--leave-one-person-out", "--name", "persons")
    tested = ["--split", "persons", "--part", "every-fold", "--out", str(results)]
    for name in PREDICTORS:
        if name not in asked.without and not _there(name, results):
            command("benchmark", "evaluate", str(release), "--predictor", name, *tested)
    command("benchmark", "sweep", str(release), *tested)
    shutil.copyfile(results / "sweep.svg", PAGE.with_name(FIGURE))
    PAGE.write_text(page(results))


def page(results: Path) -> str:
    """The page's text.

    Args:
        results: folder of the evaluations.
    """
    left = "\n".join(f"- {name}: {why}" for name, why in LEFT_OUT.items())
    return (
        "# Forces from motion alone\n\n"
        "Made by `python -m benchmarks.forces_from_motion`; [docs/benchmark.md](../docs/benchmark.md) says "
        "what the figures are. Each person is tested once; networks and cutoffs are learnt or chosen by the "
        "others. Two rules of our own entries' division between the feet (only soles that move with the "
        "ground carry; pressure stays under them) were kept after a comparison on seven of these ten "
        "persons, and the solver's settings come from recordings among these: fresh ones would be the "
        "stricter judge.\n\n"
        f"{rendered(read_results(results), 'markdown')}\n"
        "## Where ours is not ahead\n\n"
        f"{behind(read_results(results))}\n"
        f"{WHY_BEHIND}\n\n"
        "## The filter\n\n"
        f"![Error of the total force against the filter's cutoff]({FIGURE})\n\n"
        "## Recordings left out\n\n"
        f"{left}\n"
    )


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


def _there(name: str, results: Path) -> bool:
    stem = "regression" if ".py:" in name else name
    return (results / f"{stem}.parquet").exists()


if __name__ == "__main__":
    main()
