"""Forces from motion alone, judged by those that plates recorded, into NO_PLATES.md.

    python -m benchmarks.no_plates fits                         whole trials by their markers alone
    python -m benchmarks.no_plates baselines [--out DIR]        beside the dataset paper's predictors

*fits*: every recording of `benchmarks.truth.recorded` is fitted to its markers alone. Forces are predicted
from the motion and the mass that its plates read, at several cut-offs, and held against the recorded ones on
frames on which every foot's force counts. The one cut-off of all recordings is chosen on one half of the
people and judged on the other, and the other way round; what is used is printed beside it.

*baselines*: the same recordings, one folder a person, get their activity as a label and become a release;
each person is tested once, and all others train. Goes on where it was stopped, as long as DIR is the same.
"""

import argparse
import csv
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from typer.testing import CliRunner

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.results import Result, read_results
from addb_viewer.benchmark.tables import JUDGED, markdown, ranked, with_best_baseline
from addb_viewer.commands.cli import app
from benchmarks.markdown import write_section
from benchmarks.recordings import data_folder
from benchmarks.truth.recorded import ACTIVITY
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.contact.wrenches import FrameMask
from solver.dynamics.com_trajectory import com_data
from solver.dynamics.force_prediction.missing_wrench import predict_ground_forces
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.root_wrench import about_point
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.fitting.torques_stage import filter_as_forces
from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import unseen_mass_notes
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

PAGE = Path(__file__).with_name("NO_PLATES.md")
CUTOFFS_HZ = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0)
PLAIN_HZ = 6.0  # what laboratories filter walking with
FEWEST_FRAMES = 20  # that judge
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
TERMS = ("--unreviewed", "--licence", "CC0-1.0", "--consent", "public", "--workers", "1", "--source", "real")
LEARNT = ("mlp", "groundlinknet")


@dataclass(frozen=True)
class Row:
    """One trial; errors are RMS of the total force over the mass [N/kg]."""

    folder: str
    trial: str
    activity: str
    unseen: bool  # some of the body's mass carries no marker
    plain: float  # the motion low-passed at `PLAIN_HZ`, nothing else
    ours: Mapping[float, float]  # by cut-off [Hz]


def rows() -> Iterator[Row]:
    """Every trial of the bench's recordings with enough counted frames."""
    settings = replace(Settings(), trajectory=replace(Settings().trajectory, enabled=False))
    for folder, activities in ACTIVITY.items():
        fit = solve(open_subject(data_folder() / folder), settings, trials=list(activities))
        for trial in fit.trials:
            row = _row(folder, activities[trial.capture.name], trial, fit, settings)
            if row is not None:
                print(row, flush=True)
                yield row


def _row(folder: str, activity: str, trial: TrialFit, fit: Fit, settings: Settings) -> Row | None:
    assert trial.contacts is not None
    assert trial.mask is not None
    assert fit.groundwork is not None
    judged = inverse_dynamics(fit.skeleton, trial.motion, trial.contacts, trial.mask, settings.dynamics).used
    own = mass_from_forces([com_data(fit.skeleton, trial.motion, trial.contacts, trial.mask)], settings.com)
    if judged.sum() < FEWEST_FRAMES or own is None:
        return None
    skeleton = with_mass(fit.skeleton, own.mass_kg)
    demand, com = _demand(trial, filter_as_forces(trial.motion, settings), skeleton, settings)
    recorded = trial.contacts.wrench_ground[:, :, :3].sum(axis=1)

    def missed(wrench: Float[np.ndarray, "frames 6"]) -> float:
        return _rms(wrench[:, :3] - recorded, judged) / skeleton.mass

    match, rate = fit.groundwork.match, trial.motion.rate
    return Row(
        folder,
        trial.capture.name,
        activity,
        bool(unseen_mass_notes(match.skeleton(skeleton), match.observed(trial.capture.markers))),
        missed(_demand(trial, trial.motion.low_passed(PLAIN_HZ), skeleton, settings)[0]),
        {hz: missed(predict_ground_forces(demand, com, rate, hz).wrench_ground) for hz in CUTOFFS_HZ},
    )


def _demand(
    trial: TrialFit, motion: Motion, skeleton: Skeleton, settings: Settings
) -> tuple[Float[np.ndarray, "frames 6"], Float[np.ndarray, "frames 3"]]:
    """What a motion demands of the ground [N, N·m about the ground origin], and the centre of mass [m]."""
    assert trial.contacts is not None
    assert trial.mask is not None
    nothing = FrameMask(np.zeros_like(trial.mask.counts))
    dynamics = inverse_dynamics(skeleton, motion, trial.contacts, nothing, settings.dynamics)
    return about_point(dynamics.residual_root, -dynamics.root_ground), dynamics.com_ground


def _rms(values: Float[np.ndarray, "frames 3"], of: Bool[np.ndarray, " frames"]) -> float:
    return float(np.sqrt((values[of] ** 2).sum(axis=1).mean()))


def best_cutoff(of: list[Row]) -> float:
    """The one with the least geometric mean of errors."""
    return min(CUTOFFS_HZ, key=lambda hz: float(np.mean([np.log(row.ours[hz]) for row in of])))


def fits_section(of: list[Row]) -> str:
    """The table, and the halves."""
    ours_Hz = Settings().dynamics.unmeasured_cutoff_Hz
    lines = [
        "## Whole trials fitted to their markers",
        "",
        "Made by `python -m benchmarks.no_plates fits`. Total force predicted from the markers' motion and "
        "the mass, against the recorded one: RMS over frames whose forces count, N/kg. The mass is what the "
        f"trial's own plates read. *Plain*: the motion low-passed at {PLAIN_HZ:g} Hz, nothing else. The "
        "others: smooth momentum, and no force in flight "
        "([how](../docs/explanation/force-prediction.md#trials-without-any-force)). "
        "Bold: the cut-off that is used. † some of the body's mass carries no marker.",
        "",
        f"| recording | trial | activity | plain | {' | '.join(f'{hz:g} Hz' for hz in CUTOFFS_HZ)} |",
        f"|---|---|---|{'---|' * (len(CUTOFFS_HZ) + 1)}",
    ]
    for row in of:
        cells = [f"**{e:.2f}**" if hz == ours_Hz else f"{e:.2f}" for hz, e in row.ours.items()]
        mark = " †" if row.unseen else ""
        lines.append(
            f"| {row.folder}{mark} | {row.trial} | {row.activity} | {row.plain:.2f} | {' | '.join(cells)} |"
        )
    lines += ["", *_walks(of, ours_Hz), "", *_halves(of, ours_Hz), ""]
    return "\n".join(lines)


def _walks(of: list[Row], hz: float) -> Iterator[str]:
    walks = [row for row in of if row.activity == "walk" and not row.unseen]
    errors = [row.ours[hz] for row in walks]
    plain = [row.plain for row in walks]
    yield (
        f"Full-body walks ({len(walks)}): mean {np.mean(errors):.2f}, worst {max(errors):.2f} N/kg "
        f"(plain {np.mean(plain):.2f} and {max(plain):.2f})."
    )


def _halves(of: list[Row], used_Hz: float) -> Iterator[str]:
    """People in the order of their folders, every other one in a half."""
    people = list(dict.fromkeys(row.folder for row in of))
    halves = [[row for row in of if row.folder in people[k::2]] for k in (0, 1)]
    for name, chosen, judge in (("first", halves[0], halves[1]), ("second", halves[1], halves[0])):
        hz = best_cutoff(chosen)
        yield (
            f"- Chosen on the {name} half of the people: {hz:g} Hz. On the other half, geometric mean over "
            f"plain {PLAIN_HZ:g} Hz: {_against_plain(judge, hz):.3f}; {used_Hz:g} Hz: "
            f"{_against_plain(judge, used_Hz):.3f}."
        )


def _against_plain(of: list[Row], hz: float) -> float:
    return float(np.exp(np.mean([np.log(row.ours[hz] / row.plain) for row in of])))


@dataclass(frozen=True)
class Entry:
    """A predictor with its options."""

    result: str  # its name in tables
    name: str
    options: tuple[str, ...] = ()


ENTRIES = (
    Entry("analytical", "analytical"),
    *(Entry(name, name) for c in (6, 12, 30) for name in (f"analytical-{c}Hz", f"analytical-{c}Hz-soles")),
    Entry("fit-from-angles", "fit-from-angles"),
    Entry("fit-from-markers", "fit-from-markers"),
    Entry("regression", str(Path(__file__).parents[1] / "examples" / "08_own_predictor.py") + ":Regression"),
    *(Entry(name, name) for name in LEARNT),
    *(Entry(f"{name}-wide", name, ("--features", "wide")) for name in LEARNT),
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


def baselines(out: Path, without: Sequence[str]) -> str:
    """Build, split, evaluate what is not there yet, sweep, and tell it as a section.

    Args:
        out: of copies, release and results.
        without: predictors that are left out.
    """
    release, results = str(out / "release"), out / "results"
    labelled(out / "recordings")
    if not (out / "release" / "manifest.json").exists():
        command("dataset", "build", str(out / "recordings"), "--out", release, *TERMS)
    command("dataset", "split", release, "--leave-one-person-out", "--name", "persons")
    tested = ["--split", "persons", "--part", "every-fold", "--out", str(results)]
    for entry in ENTRIES:
        if entry.result not in without and not (results / f"{entry.result}.parquet").exists():
            command("benchmark", "evaluate", release, "--predictor", entry.name, *tested, *entry.options)
    command("benchmark", "sweep", release, *tested)
    shutil.copyfile(results / "sweep.svg", PAGE.with_name(FIGURE))
    return baselines_section(read_results(results))


def baselines_section(found: Sequence[Result]) -> str:
    """As Markdown.

    Args:
        found: results of all predictors.
    """
    left = "\n".join(f"- {name}: {why}" for name, why in LEFT_OUT.items())
    return (
        "## Beside the dataset paper's baselines\n\n"
        "Made by `python -m benchmarks.no_plates baselines`; [the benchmark's page]"
        "(../docs/reference/benchmark.md) says what the figures are. "
        "Each person is tested once; networks, cutoffs and standard deviations are "
        "learnt or chosen by the others. Three rules of our own entries' division between the feet were kept "
        "after comparisons on these persons: that only soles that move with the ground carry and that "
        "pressure stays under them on seven of the ten, that pressure may spare a sole's rim on all ten (how "
        "much is chosen by the others). The solver's settings come from recordings among these, too: no "
        "person here is fresh, and fresh ones would be the stricter judge.\n\n"
        f"{markdown(ranked(with_best_baseline(found)))}\n"
        f"**Where ours is not ahead**\n\n{behind(found)}\n{WHY_BEHIND}\n\n"
        f"![Error of the total force against the filter's cutoff]({FIGURE})\n\n"
        f"**Recordings left out**\n\n{left}\n"
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


def main() -> None:
    """Make a part's figures, and put its section into the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.no_plates", description=__doc__)
    parser.add_argument("part", choices=("fits", "baselines"))
    parser.add_argument("--out", type=Path, default=Path("build/benchmark"), help="of the baselines")
    parser.add_argument("--without", nargs="*", default=[], help="predictors that are left out")
    given = parser.parse_args()
    fits = given.part == "fits"
    section = fits_section(list(rows())) if fits else baselines(given.out.resolve(), given.without)
    write_section(PAGE, f"no_plates {given.part}", section)


if __name__ == "__main__":
    main()
