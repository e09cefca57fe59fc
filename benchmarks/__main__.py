"""`make bench`: marker errors, residuals and speed of every recording, into benchmarks/RESULTS.md."""

import argparse
import platform
import tempfile
from datetime import date
from pathlib import Path

from benchmarks import fit_errors
from benchmarks.markdown import table, write_section
from benchmarks.recordings import data_folder, subjects
from benchmarks.speed import stages
from benchmarks.speed.app_keys import latency_section
from solver.common.errors import SolverError
from solver.fitting.fit_result import Fit
from solver.fitting.pipeline import solve
from solver.fitting.results.store import save_fit
from solver.fitting.settings import settings_for

RESULTS = Path(__file__).parent / "RESULTS.md"
SPEED_TRIALS = {
    "walk_rajagopal2015": "walk",
    "opencap_subject4": "walking1",
    "walk_treadmill_stepwidth": "example1",
}


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
            refused.append(f"- `{name}`: {str(error).replace(f'{data_folder()}/', '')}")
            continue
        marker_rows += [fit_errors.marker_row(name, fit, trial) for trial in fit.trials]
        residual_rows += fit_errors.residual_rows(name, fit, settings)
        if name in SPEED_TRIALS:
            fits[name] = (fit, SPEED_TRIALS[name])
    speeds, app_latency = _speed(fits)
    parts = {
        "Marker errors": table(fit_errors.MARKER_COLUMNS, marker_rows),
        "Not fitted": "\n".join(refused) or "none",
        "Residuals at the root": table(fit_errors.RESIDUAL_COLUMNS, residual_rows),
        "Speed of inverse kinematics": speeds,
        "Speed of the dynamics": stages.dynamics_section(),
        "Speed of the review log": stages.log_table(),
        "Recordings and the report": stages.recordings_table(),
        "Latency of the app": app_latency,
    }
    made = f"{date.today()}, Python {platform.python_version()}. Made by `make bench`. {given.note}".strip()
    text = "\n\n".join([made, *(f"## {title}\n\n{told}" for title, told in parts.items())])
    print(text)
    if not only:
        write_section(RESULTS, "all", text)


def _speed(fits: dict[str, tuple[Fit, str]]) -> tuple[str, str]:
    """Of inverse kinematics and the app's start; and of the app's keys."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "demo"
        demo = stages.demo_fit(folder)
        fits = fits | {"synthetic, default body": (demo, demo.trials[0].capture.name)}
        save_fit(demo, folder / "results")
        seconds = min(stages.app_start_seconds(folder) for _ in range(3))
        latency = latency_section(Path(scratch))
    start = f"Start of the app to the first frame after a finished fit: {seconds:.1f} s of wall time."
    return f"{stages.kinematics_table(fits)}\n\n{start}", latency


if __name__ == "__main__":
    main()
