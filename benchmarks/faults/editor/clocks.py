"""Faults of time: forces late, at another rate, or smoothed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import butter, filtfilt

from benchmarks.faults.editor.fault import Edit, Fault, drawn_plate
from benchmarks.faults.editor.recording import Plate, Recording, Trial


def late(lags_s: Sequence[float]) -> Edit:
    """recorded(t) = true(t - lag), a lag for each trial or one for all; markers are cut to what is left."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        lags = list(lags_s) * len(recording.trials) if len(lags_s) == 1 else list(lags_s)
        trials = tuple(_late(trial, lag) for trial, lag in zip(recording.trials, lags, strict=True))
        sizes = {f"offset_s {t.name}": lag for t, lag in zip(trials, lags, strict=True)}
        what = "forces are late by " + " and ".join(f"{1e3 * lag:.0f} ms" for lag in lags)
        return replace(recording, trials=trials), Fault(what, sizes, tuple(t.name for t in trials))

    return edit


def one_plate_late(lag_s: float) -> Edit:
    """One plate's amplifier is late, the others are not."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        k = drawn_plate(recording, rng)
        trials = []
        for trial in recording.trials:
            samples = round(lag_s * trial.force_rate)
            plate = trial.plates[k]
            shifted = [np.concatenate([np.repeat(v[:1], samples, 0), v])[: len(v)] for v in _of(plate)]
            changed = trial.with_plate(k, replace(plate, force=shifted[0], moment=shifted[1]))
            trials.append(changed.cut(trial.force_times[0] + lag_s, trial.times[-1]))
        what = f"plate {k + 1} is late by {1e3 * lag_s:.0f} ms"
        names = tuple(t.name for t in trials)
        return replace(recording, trials=tuple(trials)), Fault(what, {"offset_s": lag_s}, names, plate=k + 1)

    return edit


def drifting(stretch: float) -> Edit:
    """Time of the forces = (1 + stretch) × true time, both beginning together."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trials = []
        for trial in recording.trials:
            start = trial.force_times[0]
            changed = replace(trial, force_times=start + (1 + stretch) * (trial.force_times - start))
            trials.append(changed.cut(start, min(trial.times[-1], changed.force_times[-1])))
        what = f"the forces' clock runs {100 * stretch:+.1f} % slow"
        names = tuple(t.name for t in trials)
        return replace(recording, trials=tuple(trials)), Fault(what, {"stretch": stretch}, names)

    return edit


def smoothed(cutoff_Hz: float) -> Edit:
    """All forces and moments low-passed, second order forwards and backwards."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trials = []
        for trial in recording.trials:
            # each pass at a cutoff that makes both together 3 dB there
            passes = cutoff_Hz / (np.sqrt(2) - 1) ** 0.25
            b, a = butter(2, passes / (trial.force_rate / 2))
            plates = tuple(
                replace(p, force=filtfilt(b, a, p.force, axis=0), moment=filtfilt(b, a, p.moment, axis=0))
                for p in trial.plates
            )
            trials.append(replace(trial, plates=plates))
        what = f"forces were low-passed at {cutoff_Hz:.1f} Hz"
        names = tuple(t.name for t in trials)
        return replace(recording, trials=tuple(trials)), Fault(what, {"cutoff_Hz": cutoff_Hz}, names)

    return edit


def _late(trial: Trial, lag_s: float) -> Trial:
    changed = replace(trial, force_times=trial.force_times + lag_s)
    start = max(trial.times[0], changed.force_times[0])
    return changed.cut(start, min(trial.times[-1], changed.force_times[-1]))


def _of(plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    return plate.force, plate.moment
