"""An elastic band between the trunk and a fixed point of the room."""

from dataclasses import replace

import numpy as np

from benchmarks.faults.editor.fault import Edit, Fault
from benchmarks.faults.editor.people import felt, pelvis
from benchmarks.faults.editor.recording import Recording


def banded(stiffness_N_m: float, slack_m: float, behind_m: float) -> Edit:
    """Pulls the pelvis back to a point behind its mean place; the plates feel what is left, by load."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trials, peaks = [], []
        for trial in recording.trials:
            at = pelvis(trial)
            pull = _pull(at, stiffness_N_m, slack_m, behind_m)
            peaks.append(float(np.linalg.norm(pull, axis=1).max()))
            trials.append(felt(trial, at, pull))
        names = tuple(t.name for t in trials)
        what = f"a band at the pelvis pulls with up to {max(peaks):.0f} N"
        fault = Fault(what, {"force_N": max(peaks)}, names)
        return replace(recording, trials=tuple(trials)), fault

    return edit


def _pull(at: np.ndarray, stiffness_N_m: float, slack_m: float, behind_m: float) -> np.ndarray:
    """On the person (samples, 3) [N]."""
    way = at[-1] - at[0]
    way[1] = 0.0
    length = np.linalg.norm(way)
    forward = way / length if length > 0.3 else np.array([1.0, 0.0, 0.0])
    anchor = at.mean(axis=0) - behind_m * forward
    line = anchor - at
    distance = np.linalg.norm(line, axis=1, keepdims=True)
    return stiffness_N_m * np.maximum(distance - slack_m, 0.0) * line / distance
