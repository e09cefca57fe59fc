"""Time and memory of a fit by the length of its trial, 120 to 100 000 frames, into PERFORMANCE.md.

python -m benchmarks.long_trials --folder DIR                   goes on where it was stopped, then the page
python -m benchmarks.long_trials --folder DIR --frames 100000   this length alone, then the page
python -m benchmarks.long_trials --folder DIR --rewrite 100000  write and read its kept fit again, then page
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np

from benchmarks.sections import write_section
from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.subject.subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.results.store import load_fit, save_fit
from solver.fitting.settings import Settings
from solver.simulate.demo import MARKERS
from solver.simulate.gait import STYLES, natural_pace, stature_of
from solver.simulate.laboratory import MeasurementSettings, recorded_markers
from solver.simulate.person import Person, body_of
from solver.simulate.subject_folder import write_subject
from solver.simulate.treadmill import belt_under, belts, on_treadmill, read_belts
from solver.simulate.trial import Scenario, simulate_trial

PAGE = Path(__file__).parent / "PERFORMANCE.md"
SECTION = """## A fit by the length of its trial

{date}, `python -m benchmarks.long_trials --folder DIR`: a simulated stride on a treadmill, repeated, with
fresh marker noise; default body (37 degrees of freedom, {markers} markers), 100 Hz, plates at
{plate_rate:g} Hz. CPU seconds of one core, one BLAS thread; memory is the most that the process held, the
program's own {own:.0f} MB included. The solve includes the first layout of held-out forces; "one round" is a
single iteration and nothing held out, which holds as much in less time. Residuals are RMS. ¹ By a process
that had solved nothing.

| frames | solve | per 1000 frames | peak | write | read | residual force | held-out |
|---:|---:|---:|---:|---:|---:|---:|---:|
{table}
"""
LENGTHS = (120, 500, 2000, 8000, 20_000, 40_000)  # frames
STRIDE_S = 1.08
STRIDES = 3  # simulated before the one that is repeated, and after it
QUIET = MeasurementSettings(force_rate=500.0, marker_noise_m=0.0, gaps_per_marker_minute=0.0)
NOISE_M = 0.0002
SEED = 7


def write_repeated_walk(folder: Path, frames: int) -> None:
    """A subject of one trial: a stride on a treadmill, simulated once and repeated, with fresh marker noise.

    Args:
        folder: made if it doesn't exist.
        frames: of the trial, at 100 Hz.
    """
    rng = np.random.default_rng(SEED)
    who = Person(sex="female")
    body = body_of(who, rng)
    stature = stature_of(body.skeleton)
    usual = natural_pace(1.3, stature, STYLES["walk"])
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
    capture = Capture(
        "walk",
        Markers(markers.names, places, markers.rate),
        tuple(_repeated_plate(plate, samples) for plate in plates),
    )
    write_subject(folder, who, [capture])


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


@dataclass(frozen=True)
class Figures:
    """Of one length; CPU seconds on one core, and the most memory that the process held [MB]."""

    frames: int
    solve_s: float  # with the first layout of held-out forces
    save_s: float
    load_s: float
    solve_MB: float
    save_MB: float
    load_MB: float  # the loaded fit beside the one that was solved
    residual_N: float
    held_out_N: float | None  # None: one round, and nothing held out
    rewritten: bool = False  # the kept fit was written and read anew, without a solve


Result = TypeVar("Result")


def measured(folder: Path, *, one_round: bool = False) -> Figures:
    """Solve, write and read a subject, in this process; Linux alone tells the peaks one by one.

    Args:
        folder: of the subject.
        one_round: a single iteration and no layout of held-out forces: it holds as much, in less time.
    """
    settings = Settings()
    if one_round:
        once = replace(settings.trajectory, iterations=1, held_out=False)
        settings = replace(settings, trajectory=once)
    fit, solve_s, solve_MB = _told(lambda: solve(open_subject(folder), settings))
    _, save_s, save_MB = _told(lambda: save_fit(fit, folder / "results"))
    _, load_s, load_MB = _told(lambda: load_fit(folder / "results", folder))
    (trial,) = fit.trials
    assert trial.dynamics is not None
    residual = _rms(trial.dynamics.residual_root[trial.dynamics.used, :3])
    held_out = (
        None if trial.held_out is None else _rms(trial.held_out.residual_root[trial.held_out.frames, :3])
    )
    return Figures(
        trial.motion.frames,
        solve_s,
        save_s,
        load_s,
        solve_MB,
        save_MB,
        load_MB,
        residual,
        held_out,
    )


def rewritten(folder: Path, before: Figures) -> Figures:
    """Write and read the kept fit of a subject once more, in this process.

    Args:
        folder: of the subject.
        before: its figures.
    """
    fit = load_fit(folder / "results", folder)
    with TemporaryDirectory(dir=folder) as place:
        _, save_s, save_MB = _told(lambda: save_fit(fit, Path(place) / "results"))
        _, load_s, load_MB = _told(lambda: load_fit(Path(place) / "results", folder))
    return replace(before, save_s=save_s, save_MB=save_MB, load_s=load_s, load_MB=load_MB, rewritten=True)


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def _told(work: Callable[[], Result]) -> tuple[Result, float, float]:
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    start = time.process_time()
    result = work()
    seconds = time.process_time() - start
    (line,) = (x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmHWM"))
    return result, seconds, int(line.split()[1]) / 1024


def section(figures: Sequence[Figures]) -> str:
    """As Markdown."""
    rows = [
        f"| {f.frames} | {f.solve_s:.0f} s | {1000 * f.solve_s / f.frames:.1f} s | {f.solve_MB:.0f} MB "
        f"| {f.save_s:.1f} s, {f.save_MB:.0f} MB{'¹' if f.rewritten else ''} "
        f"| {f.load_s:.1f} s, {f.load_MB:.0f} MB{'¹' if f.rewritten else ''} "
        f"| {f.residual_N:.1f} N | {'one round' if f.held_out_N is None else f'{f.held_out_N:.1f} N'} |"
        for f in figures
    ]
    return SECTION.format(
        date=date.today().isoformat(),
        markers=len(MARKERS),
        plate_rate=QUIET.force_rate,
        own=_own_MB(),
        table="\n".join(rows),
    )


def _own_MB() -> float:
    command = [
        sys.executable,
        "-c",
        "import psutil, solver.fitting.pipeline; print(psutil.Process().memory_info().rss)",
    ]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout) / 2**20


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure what is still missing, each length in a process of its own, and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, required=True, help="for subjects and figures")
    parser.add_argument("--frames", type=int, nargs="*", default=LENGTHS, help="lengths")
    parser.add_argument("--measure", action="store_true", help="a subject's folder, in this process")
    parser.add_argument(
        "--one-round", action="store_true", help="one iteration, nothing held out: memory only"
    )
    parser.add_argument("--rewrite", type=int, help="a length whose kept fit is written and read anew")
    given = parser.parse_args(arguments)
    if given.rewrite:
        told = given.folder / f"{given.rewrite}.json"
        before = Figures(**json.loads(told.read_text()))
        told.write_text(json.dumps(asdict(rewritten(given.folder / f"walk_{given.rewrite}", before))))
        given.frames = []
    if given.measure:
        print(json.dumps(asdict(measured(given.folder, one_round=given.one_round))))
        return
    given.folder.mkdir(parents=True, exist_ok=True)
    for frames in given.frames:
        told, subject = given.folder / f"{frames}.json", given.folder / f"walk_{frames}"
        if told.exists():
            continue
        if not subject.is_dir():
            draft = given.folder / f"walk_{frames}.draft"
            write_repeated_walk(draft, frames)
            draft.rename(subject)
        command = [sys.executable, "-m", "benchmarks.long_trials", "--measure", "--folder", str(subject)]
        command += ["--one-round"] if given.one_round else []
        output = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        told.write_text(output.splitlines()[-1])
        print(output.splitlines()[-1], flush=True)
    found = [Figures(**json.loads(file.read_text())) for file in given.folder.glob("*.json")]
    write_section(PAGE, "long_trials", section(sorted(found, key=lambda f: f.frames)))


if __name__ == "__main__":
    main()
