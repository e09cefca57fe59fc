"""`make bench`: all tables into benchmarks/RESULTS.md."""

import argparse
import platform
import tempfile
from datetime import date
from pathlib import Path

from benchmarks import dynamics, kinematics, speed
from benchmarks.annotations_speed import annotations_speed_table
from benchmarks.app_latency import app_latency_section
from benchmarks.dynamics_speed import dynamics_speed_section
from benchmarks.recordings import subjects
from benchmarks.recordings_speed import recordings_speed_table
from solver.common.errors import SolverError
from solver.fitting.fit import Fit
from solver.fitting.pipeline import solve
from solver.fitting.results.store import save_fit
from solver.fitting.settings import settings_for

RESULTS = Path(__file__).parent / "RESULTS.md"
SPEED_TRIALS = {
    "walk_rajagopal2015": "walk",
    "opencap_subject4": "walking1",
    "walk_treadmill_stepwidth": "example1",
}


PAGE = """# Results

{date}, Python {python}, one core of a shared 2-core machine. Made by `make bench`. CPU seconds;
best compared as a ratio within one run.{note}

## Marker errors

Against the raw markers, every marker that model and recording share, after the whole fit (kinematics and
dynamics); the generic model is scaled by us. The engine is AddBiomechanics, measured beforehand.

{markers}

Not fitted:

{refused}

## Residuals at the root

External wrench that the motion demands less the measured one: force, and moment about the root joint's centre
in the ground frame, RMS over the frames used. Mask `none`: nobody reviewed the recording. Held out: forces of
every third block of 0.22 s were kept from the fit and then predicted. Referee: OpenSim's inverse dynamics on
our exported files, without a filter.

{residuals}

## Speed of inverse kinematics

{speed}

## Speed of the dynamics

Trajectory fit: from the markers' motion, held-out blocks not among it. Re-solve: after an edit of the flags,
the last fit in memory. Flagged: 0.4 s of one foot in the middle of the frames used; then the flag is taken
back. Its held-out blocks are predicted afterwards. Long walks are synthetic, on a treadmill with a plate
under each belt.

{dynamics_speed}

## Speed of the review log

Medians of wall and CPU time. A trial of 10000 frames and two feet with 500 edits by three people at random
frames, so that they differ nearly everywhere. Appending and undoing end when the edit is on the disk.

{annotations_speed}

## Recordings and the report

Median CPU time and size of what is written of one synthetic trial: 2000 frames at 100 Hz, 60 markers,
22 segments, two plates.

{recordings_speed}

## Latency of the app

Server side: from a key that is sent to the echo that has arrived, on a trial of 10000 frames and 60 markers.
A step of one frame, a frame typed into a box, forty frames flagged on top of all that were flagged before.
*Four play*: four more browsers replay four such trials; *ten play*: ten, while a solve is at work, all
on this machine. A step and a seek are over when the page has been told where the cursor stands, which it
draws itself.

{app_latency}
"""


def main() -> None:
    """Fit every real recording and write the tables."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument("--only", help="part of a recording's folder name", default="")
    arguments.add_argument("--note", help="a sentence on the circumstances of this run", default="")
    given = arguments.parse_args()
    only = given.only
    marker_rows, residual_rows, refused, fits = [], [], [], {}
    for name, subject in subjects():
        if only not in name:
            continue
        print(name, flush=True)
        try:
            if isinstance(subject, SolverError):
                raise subject
            settings = settings_for(subject.folder)
            fit = solve(subject, settings)
        except SolverError as error:
            refused.append(f"- `{name}`: {_without_paths(str(error))}")
            continue
        marker_rows += [kinematics.marker_row(name, fit, trial) for trial in fit.trials]
        residual_rows += dynamics.residual_rows(name, fit, settings)
        if name in SPEED_TRIALS:
            fits[name] = (fit, SPEED_TRIALS[name])
    speeds, app_latency = _speed(fits)
    text = PAGE.format(
        date=f"{date.today():%Y-%m-%d}",
        python=platform.python_version(),
        note=f" {given.note}" if given.note else "",
        markers=kinematics.marker_table(marker_rows),
        refused="\n".join(refused) or "none",
        residuals=dynamics.residual_table(residual_rows),
        speed=speeds,
        dynamics_speed=dynamics_speed_section(),
        annotations_speed=annotations_speed_table(),
        recordings_speed=recordings_speed_table(),
        app_latency=app_latency,
    )
    RESULTS.write_text(text, encoding="utf-8")
    print(text)


def _speed(fits: dict[str, tuple[Fit, str]]) -> tuple[str, str]:
    """Of inverse kinematics and the app's start; and of the app's keys."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "demo"
        demo = speed.demo_fit(folder)
        fits = fits | {"synthetic, default body": (demo, demo.trials[0].capture.name)}
        save_fit(demo, folder / "results")
        seconds = [speed.app_start_seconds(folder) for _ in range(3)]
        latency = app_latency_section(folder)
    start = f"Start of the app to the first frame after a finished fit: {min(seconds):.1f} s of wall time."
    return f"{speed.speed_table(fits)}\n\n{start}", latency


def _without_paths(message: str) -> str:
    """A message without the folder that this machine keeps the recordings in."""
    from benchmarks.recordings import data_folder  # noqa: PLC0415

    return message.replace(f"{data_folder()}/", "")


if __name__ == "__main__":
    main()
