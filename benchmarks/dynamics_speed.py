"""CPU seconds and memory of the trajectory fit and of a re-solve after an edit of the flags.

python -m benchmarks.dynamics_speed                    the section of RESULTS.md
python -m benchmarks.dynamics_speed SUBJECT REPEATS    figures of a subject's first trial, as JSON
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.long_walk import write_long_walk
from benchmarks.recordings import data_folder
from solver.capture.subject.subject import open_subject
from solver.common.progress import silent
from solver.contact.force_review import ForceLabel, ForceReview
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.held_out_stage import predicting_held_out
from solver.fitting.pipeline import fit_to_forces, resolve, solve
from solver.fitting.settings import Settings, settings_for
from solver.fitting.state import FitState
from solver.skeleton.scaling import with_mass

EDIT_S = 0.4  # half a stance of one foot is flagged
Result = TypeVar("Result")
DURATIONS_S = (10.0, 100.0)  # 1000 and 10 000 frames
REPEATS = 3
SEED = 3


@dataclass(frozen=True)
class Figures:
    """Of one subject with one trial; CPU seconds on one core."""

    frames: int
    dofs: int
    solve_s: float
    fit_s: float
    first_flag_s: float
    flag_s: float
    unflag_s: float
    held_out_s: float
    peak_memory_MB: float


def figures_of(folder: Path, repeats: int) -> Figures:
    """Solve, fit again by itself, flag two half stances one after the other, and take the second back."""
    subject, settings = open_subject(folder), settings_for(folder)
    name = subject.trials[0].name
    solved, solve_s = _timed(lambda: solve(subject, settings, trials=[name]), 1)
    (trial,) = solved.trials
    later, earlier = _edits(trial)
    one, two = ({name: ForceReview(by_people=edits)} for edits in ((later,), (later, earlier)))
    first, first_flag_s = _timed(lambda: resolve(solved, one, settings), repeats)
    flagged, flag_s = _timed(lambda: resolve(first, two, settings), repeats)
    _, unflag_s = _timed(lambda: resolve(flagged, one, settings), repeats)
    _, held_out_s = _timed(lambda: predicting_held_out(flagged, settings, silent), 1)
    _, fit_s = _timed(lambda: _trajectory_fit(solved, settings), repeats)
    return Figures(
        frames=trial.motion.frames,
        dofs=len(solved.skeleton.dofs),
        solve_s=solve_s,
        fit_s=fit_s,
        first_flag_s=first_flag_s,
        flag_s=flag_s,
        unflag_s=unflag_s,
        held_out_s=held_out_s,
        peak_memory_MB=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    )


def dynamics_speed_section() -> str:
    """The trajectory fit and the re-solve of a real walk, and how both grow with the trial's length."""
    real = _in_new_process(data_folder() / "walk_rajagopal2015", REPEATS)
    with tempfile.TemporaryDirectory() as scratch:
        short, long = (_of_long_walk(Path(scratch) / f"{d:g}", d) for d in DURATIONS_S)
    lines = [
        "| trial | frames | dofs | trajectory fit | solve | first flag | next flag | flag taken back "
        "| its held-out blocks | peak memory |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    named = (("walk_rajagopal2015", real), ("long walk, 10 s", short), ("long walk, 100 s", long))
    lines += [_row(title, figures) for title, figures in named]
    ratio, fit_ratio = long.solve_s / short.solve_s, long.fit_s / short.fit_s
    return (
        "\n".join(lines)
        + f"\n\nFrom {short.frames} to {long.frames} frames the whole solve takes {ratio:.1f} times as long, "
        f"the trajectory fit {fit_ratio:.1f} times."
    )


def _row(title: str, figures: Figures) -> str:
    per_1000 = 1000 / figures.frames
    cells = (
        title,
        f"{figures.frames}",
        f"{figures.dofs}",
        f"{figures.fit_s:.2f} s, {figures.frames / figures.fit_s:.0f} frames/s",
        f"{figures.solve_s:.1f} s",
        *(
            f"{per_1000 * seconds:.2f} s per 1000 frames"
            for seconds in (figures.first_flag_s, figures.flag_s, figures.unflag_s, figures.held_out_s)
        ),
        f"{figures.peak_memory_MB:.0f} MB",
    )
    return f"| {' | '.join(cells)} |"


def _of_long_walk(folder: Path, duration_s: float) -> Figures:
    write_long_walk(folder, duration_s, np.random.default_rng(SEED))
    return _in_new_process(folder, 1)


def _in_new_process(folder: Path, repeats: int) -> Figures:
    """Alone, so that the peak of memory is its own."""
    command = [sys.executable, "-m", "benchmarks.dynamics_speed", str(folder), str(repeats)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return Figures(**json.loads(done.stdout))


def _edits(trial: TrialFit) -> tuple[ForceLabel, ForceLabel]:
    """Half a stance of the first foot at two thirds of the frames used, and at one third."""
    assert trial.dynamics is not None
    assert trial.contacts is not None
    used, foot = np.flatnonzero(trial.dynamics.used), trial.contacts.foot_bodies[0]
    length = round(EDIT_S * trial.motion.rate)
    later, earlier = (int(used[share * len(used) // 3]) for share in (2, 1))
    ends = [min(start + length, trial.motion.frames) for start in (later, earlier)]
    return (
        ForceLabel(later, ends[0], foot, "manualReview"),
        ForceLabel(earlier, ends[1], foot, "manualReview"),
    )


def _trajectory_fit(fit: Fit, settings: Settings) -> None:
    """The stage alone, from the markers' motion."""
    assert fit.groundwork is not None
    assert fit.groundwork.mass_kg is not None
    begun = [
        replace(
            trial,
            motion=trial.kinematics_only.motion,
            marker_errors=trial.kinematics_only.marker_errors,
            kinematics_only=None,
            spline=None,
        )
        for trial in fit.trials
        if trial.kinematics_only is not None
    ]
    skeleton = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg)
    groundwork = replace(fit.groundwork, phi=None)
    state = FitState(fit.subject, groundwork, skeleton, trials=tuple(begun))
    fit_to_forces(state, settings, silent)


def _timed(work: Callable[[], Result], repeats: int) -> tuple[Result, float]:
    """What some work gives, and the CPU seconds of its fastest run."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        result = work()
        best = min(best, time.process_time() - start)
    return result, best


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(asdict(figures_of(Path(sys.argv[1]), int(sys.argv[2])))))
    else:
        print(dynamics_speed_section())
