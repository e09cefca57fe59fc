"""The demo subject: a synthetic person whose walk misses a plate."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from solver.capture.atomic import made_folder
from solver.common.errors import CaptureError
from solver.common.one_thread import one_thread
from solver.simulate.demo_subject import SCENARIOS, LateForces, write_demo_subject

SEED = 20_240_901  # any number: the same demo for everyone
MARK = ".addb-viewer-demo"  # marks a folder that the demo may write over
TRIALS = tuple(scenario.name for scenario in SCENARIOS)


def make_demo(folder: Path, trials: Sequence[str] = TRIALS) -> None:
    """Write the demo subject, whose forces come late, in place of an earlier one.

    Args:
        folder: made where it is missing.
        trials: which of them.

    Raises:
        CaptureError: the folder holds something else, or there is no such trial.
    """
    strangers = [name for name in trials if name not in TRIALS]
    if strangers:
        raise CaptureError(f"the demo has no trial '{strangers[0]}'; it has {', '.join(TRIALS)}")
    mark = folder / MARK
    if folder.is_dir() and any(folder.iterdir()) and not mark.is_file():
        raise CaptureError(f"{folder}: not empty and not the demo's; choose another folder with --folder")
    made_folder(folder)
    mark.touch()
    recordings = [f"trials/{trial}/{file}" for trial in trials for file in ("markers.trc", "grf.mot")]
    for name in ("_subject.json", *recordings):
        (folder / name).unlink(missing_ok=True)
    with one_thread():  # a second one waits twenty times as long where other programs are at work
        write_demo_subject(folder, np.random.default_rng(SEED), trials=tuple(trials), cause=LateForces())
