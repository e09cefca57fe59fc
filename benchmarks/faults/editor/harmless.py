"""Changes that leave a recording sound: other axes of the laboratory, another stretch, fewer samples."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import decimate

from benchmarks.faults.editor.fault import Edit, Fault, NoPlaceError
from benchmarks.faults.editor.recording import Recording, Trial


def axes_turned(degrees: float, east_m: float, south_m: float) -> Edit:
    """Everything turned about the vertical and moved, markers and plates alike."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    shift = np.array([east_m, 0.0, south_m])

    def change(trial: Trial) -> Trial:
        plates = []
        for plate in trial.plates:
            force = plate.force @ R.T
            plates.append(replace(plate, force=force, moment=plate.moment @ R.T + np.cross(shift, force)))
        return replace(trial, positions=trial.positions @ R.T + shift, plates=tuple(plates))

    return _all(change, f"nothing: the laboratory's axes turned by {degrees:.0f}° and moved")


def fewer_force_samples(least_Hz: float = 300.0) -> Edit:
    """Every second sample of the forces, as long as enough are left."""

    def change(trial: Trial) -> Trial:
        if trial.force_rate / 2 < least_Hz:
            raise NoPlaceError("forces are slow as they are")
        plates = tuple(
            replace(p, force=decimate(p.force, 2, axis=0), moment=decimate(p.moment, 2, axis=0))
            for p in trial.plates
        )
        return replace(trial, plates=plates, force_times=trial.force_times[::2])

    return _all(change, "nothing: forces at half the rate")


def part(first: float, last: float) -> Edit:
    """From one share of the time to another."""

    def change(trial: Trial) -> Trial:
        start, end = trial.times[0], trial.times[-1]
        return trial.cut(start + first * (end - start), start + last * (end - start))

    return _all(change, f"nothing: from {100 * first:.0f} to {100 * last:.0f} % of the trial")


def as_it_is() -> Edit:
    """Nothing."""
    return _all(lambda trial: trial, "nothing")


def _all(change: Callable[[Trial], Trial], what: str) -> Edit:
    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        return replace(recording, trials=tuple(change(t) for t in recording.trials)), Fault(what)

    return edit
