"""`make bench`: all tables into benchmarks/RESULTS.md."""

import argparse
import platform
import tempfile
from datetime import date
from pathlib import Path

from benchmarks import dynamics, kinematics, speed
from benchmarks.recordings import subjects
from solver.errors import SolverError
from solver.fit import Fit
from solver.pipeline import solve
from solver.results.store import save_fit
from solver.settings import Settings, settings_for

RESULTS = Path(__file__).parent / "RESULTS.md"
SPEED_TRIALS = {"walk_rajagopal2015": "walk", "opencap_subject4": "walking1", "walk_treadmill_stepwidth": "example1"}


def main() -> None:
    """Fit every real recording and write the tables."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    arguments.add_argument("--only", help="part of a recording's folder name", default="")
    only = arguments.parse_args().only
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
    text = "\n\n".join(
        [
            "# Results",
            f"{date.today():%Y-%m-%d}, Python {platform.python_version()}, one core of a shared 2-core machine. "
            "Made by `make bench`; CPU seconds, best compared as a ratio within one run.",
            "## Marker errors",
            "Against the raw markers, every marker that model and recording share. The generic model is scaled by "
            "us. The engine's figures: AddBiomechanics as measured beforehand, not in this run.",
            kinematics.marker_table(marker_rows),
            "Not fitted:\n\n" + ("\n".join(refused) or "none"),
            "## Residuals at the root, kinematics only",
            "Force, and moment about the root joint's centre, over the frames used; motion and forces through the same "
            "filter. `none` as mask: no review of the recording exists, so steps beside the plates count as residual.",
            dynamics.residual_table(residual_rows),
            "## Speed of inverse kinematics",
            _speed(fits),
        ]
    )
    RESULTS.write_text(text + "\n", encoding="utf-8")
    print(text)


def _speed(fits: dict[str, tuple[Fit, str]]) -> str:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "demo"
        demo = speed.demo_fit(folder)
        fits = fits | {"synthetic, default body": (demo, demo.trials[0].capture.name)}
        save_fit(demo, folder / "results")
        seconds = [speed.app_start_seconds(folder) for _ in range(3)]
    return (
        speed.speed_table(fits)
        + f"\n\nStart of the app to the first frame after a finished fit: {min(seconds):.1f} s of wall time."
    )


def _without_paths(message: str) -> str:
    """A message without the folder that this machine keeps the recordings in."""
    from benchmarks.recordings import data_folder  # noqa: PLC0415

    return message.replace(f"{data_folder()}/", "")


if __name__ == "__main__":
    main()
