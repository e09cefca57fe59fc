"""What commands cost: fits, diagnoses and releases by the length of a trial, and by trials and workers.

Each command runs in processes of its own, on fresh folders. CPU seconds are of the command and all its
processes, memory is the most that one process held.
"""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np

from addb_viewer.dataset.synthesis.corpus import CorpusOptions, synthesize
from benchmarks.markdown import table
from benchmarks.speed.measuring import Cost, Kept, cost_of
from solver.capture.capture import Capture, ForcePlate, Markers
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, recorded_markers
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.subject_folder import write_subject
from solver.simulate.treadmill import belt_under, belts, on_treadmill, read_belts
from solver.simulate.walk_and_run import STYLES, natural_pace, stature_of

SECTION = """## Fits, diagnoses and releases

{date}, `python -m benchmarks.speed commands --folder DIR`. CPU seconds are of a command and all its
processes, one BLAS thread each; memory is the most that one process held. *Load* is how many processes wanted
a core at a command's end: where it is more than the workers, seconds on the clock say little.

**By a trial's length**: one subject with one trial, 100 Hz, a simulated stride on a treadmill, repeated,
with fresh marker noise; default body ({markers} markers), plates at {plate_rate:g} Hz. A release is
everything from a folder to it.

{lengths}

**By trials and workers**: synthetic walks, {each} trials a subject, default body.

{trials}

**All of the published dataset**: 24 million frames. Nobody publishes how they spread over trials; assumed:
{shares}. Every trial is a subject of its own, and costs between two measured lengths are those of the shorter
one a frame, so rather too high: {projection}.
"""
LENGTHS = (120, 500, 2000, 8000, 20_000, 100_000)  # frames
DIAGNOSED = 20_000  # and below
TRIALS = (25, 100)
WORKERS = (1, 2)
STRIDE_S = 1.08
STRIDES = 3  # simulated before the one that is repeated, and after it
QUIET = MeasurementSettings(force_rate=500.0, marker_noise_m=0.0, gaps_per_marker_minute=0.0)
NOISE_M = 0.0002
SEED = 7
EACH = 5  # trials of a subject
CORPUS = CorpusOptions(1, seed=4, traps=False, actors=2, activities=("walk",), longest_s=1.2, takes=EACH)
TERMS = ("--licence", "CC0-1.0", "--consent", "public", "--unreviewed")
WHOLE_FRAMES = 24e6  # of the published dataset
SHARES = {120: 0.10, 500: 0.45, 2000: 0.35, 20_000: 0.10}
"""Of all frames, in trials of that length: an assumption. The paper's figure of lengths shows most of its
segments below 500 frames, and cuts at 2000; its treadmill sources recorded minutes at a time."""


def write_repeated_walk(folder: Path, frames: int) -> None:
    """A subject of one trial: a stride on a treadmill, simulated once and repeated, with fresh marker noise.

    Args:
        folder: made if it doesn't exist.
        frames: of the trial, at 100 Hz.
    """
    rng = np.random.default_rng(SEED)
    who = Person(sex="female")
    body = body_of(who, rng)
    usual = natural_pace(1.3, stature_of(body.skeleton), STYLES["walk"])
    speed = 1.3 * (2 * usual.step_time / STRIDE_S) ** (1 / 0.42)  # steps quicken with speed to that power
    duration = (2 * STRIDES + 1) * STRIDE_S
    scenario = Scenario("walk", "walk", duration=duration, speed=speed, variation=0.0)
    overground = simulate_trial(scenario, body, rng)
    trial = on_treadmill(overground, belt_under(overground, speed))
    markers = recorded_markers(trial, MARKERS, QUIET, rng)
    plates = read_belts(trial, belts(), QUIET, rng)
    places = _repeated(markers.positions_ground, QUIET.marker_rate, frames)
    places = places + NOISE_M * rng.standard_normal(places.shape)
    samples = int((frames - 1) * QUIET.force_rate / QUIET.marker_rate) + 1
    repeated = tuple(_repeated_plate(plate, samples) for plate in plates)
    write_subject(folder, who, [Capture("walk", Markers(markers.names, places, markers.rate), repeated)])


def _repeated(values: np.ndarray, rate: float, count: int) -> np.ndarray:
    period = round(STRIDE_S * rate)
    return values[STRIDES * period + np.arange(count) % period]


def _repeated_plate(plate: ForcePlate, samples: int) -> ForcePlate:
    return replace(
        plate,
        force_ground=_repeated(plate.force_ground, plate.rate, samples),
        moment_ground=_repeated(plate.moment_ground, plate.rate, samples),
        cop_ground=_repeated(plate.cop_ground, plate.rate, samples),
    )


def section(folder: Path, lengths: Sequence[int] = LENGTHS, trials: Sequence[int] = TRIALS) -> str:
    """Measure what is not there yet, and tell all as Markdown.

    Args:
        folder: of subjects and figures.
        lengths: of the one trial [frames].
        trials: how many there are of 1.3 s.
    """
    kept = Kept(folder / "commands.json")
    costs = {frames: _by_length(kept, folder, frames) for frames in lengths}
    shares = ", ".join(f"{100 * share:.0f} % in trials of {n}" for n, share in SHARES.items())
    return SECTION.format(
        date=date.today(),
        markers=len(MARKERS),
        plate_rate=QUIET.force_rate,
        each=EACH,
        lengths=_lengths_table(costs),
        trials=_trials_table(kept, folder, trials),
        shares=shares,
        projection=_projection(costs),
    )


def _by_length(kept: Kept, folder: Path, frames: int) -> dict[str, dict[str, float]]:
    """Costs of fit, release and diagnosis of one trial."""
    root = folder / f"length_{frames}"
    _made(root, lambda draft: write_repeated_walk(draft / "subject", frames))
    subject = str(root / "subject")
    commands = {
        "fit": lambda: cost_of("fit", subject, "--force"),
        "release": lambda: _release(root, 1),
        "diagnosis": lambda: cost_of("diagnose", subject),
    }
    wanted = commands if frames <= DIAGNOSED else {n: c for n, c in commands.items() if n != "diagnosis"}
    return {name: kept.get(f"{name} of {frames} frames", make) for name, make in wanted.items()}


def _release(root: Path, workers: int) -> Cost:
    out = root.with_name(f"{root.name}.release")
    for left in (out, out.with_name(f"{out.name}.work")):
        shutil.rmtree(left, ignore_errors=True)
    return cost_of("dataset", "build", str(root), "--out", str(out), "--workers", str(workers), *TERMS)


def _made(root: Path, write: Callable[[Path], object]) -> None:
    """A folder that is there or not, but never in part."""
    draft = root.with_name(f"{root.name}.draft")
    if not root.is_dir():
        for left in (draft, draft.with_name(f"{draft.name}.truth")):
            shutil.rmtree(left, ignore_errors=True)
        write(draft)
        draft.rename(root)


def _lengths_table(costs: dict[int, dict[str, dict[str, float]]]) -> str:
    rows = []
    for frames, by_command in costs.items():
        row: list[object] = [frames]
        for name in ("fit", "release", "diagnosis"):
            cost = by_command.get(name)
            per_frame = (
                ""
                if cost is None
                else f"{cost['cpu_s']:.0f} s, {1000 * cost['cpu_s'] / frames:.1f} ms a frame"
            )
            row += [per_frame, "" if cost is None else f"{cost['peak_MB']:.0f} MB"]
        rows.append(row)
    return table(["frames", "fit", "memory", "release", "memory", "diagnosis", "memory"], rows)


def _trials_table(kept: Kept, folder: Path, trials: Sequence[int]) -> str:
    rows = []
    for count in trials:
        root = folder / f"trials_{count}"
        _made(root, lambda draft, count=count: synthesize(draft, replace(CORPUS, subjects=count // EACH)))
        for workers in WORKERS:
            jobs = ("--jobs", str(workers), "--force")
            for name, make in (
                ("fit", lambda root=root, jobs=jobs: cost_of("fit", str(root), *jobs)),
                ("release", lambda root=root, workers=workers: _release(root, workers)),
            ):
                cost = kept.get(f"{name} of {count} trials by {workers}", make)
                seconds = (f"{cost['seconds']:.0f} s", f"{cost['cpu_s']:.0f} s")
                rows.append(
                    [count, name, workers, *seconds, f"{cost['peak_MB']:.0f} MB", f"{cost['load']:.1f}"]
                )
    return table(["trials", "command", "workers", "clock", "CPU", "memory", "load"], rows)


def _projection(costs: dict[int, dict[str, dict[str, float]]]) -> str:
    told = []
    for words, names in (("built", ("release",)), ("built and diagnosed", ("release", "diagnosis"))):
        known = {n: sum(c[name]["cpu_s"] for name in names) for n, c in costs.items() if set(names) <= set(c)}
        if known:
            at = {n: max((k for k in known if k <= n), default=min(known)) for n in SHARES}
            total = WHOLE_FRAMES * sum(share * known[at[n]] / at[n] for n, share in SHARES.items())
            told.append(f"{words} {total / 3600:.0f} core hours")
    return ", ".join(told)
