"""An elastic band between the trunk and a fixed point of the room."""

from dataclasses import replace

import numpy as np

from benchmarks.faults.editor.fault import Edit, Fault, NoPlaceError
from benchmarks.faults.editor.people import loads_of
from benchmarks.faults.editor.recording import Recording, Trial

PELVIS = ("asi", "psi", "sacr")  # parts of markers' names, in small letters


def banded(stiffness_N_m: float, slack_m: float, behind_m: float) -> Edit:
    """Pulls the pelvis back to a point behind its mean place; the plates feel what is left, by load."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        trials, peaks = [], []
        for trial in recording.trials:
            pelvis = _pelvis(trial)
            pull = _pull(pelvis, stiffness_N_m, slack_m, behind_m)
            peaks.append(float(np.linalg.norm(pull, axis=1).max()))
            trials.append(_felt(trial, pelvis, pull))
        names = tuple(t.name for t in trials)
        what = f"a band at the pelvis pulls with up to {max(peaks):.0f} N"
        fault = Fault(what, {"force_N": max(peaks)}, names)
        return replace(recording, trials=tuple(trials)), fault

    return edit


def _pelvis(trial: Trial) -> np.ndarray:
    """Its markers' middle at the forces' times (samples, 3) [m]."""
    of_it = [k for k, label in enumerate(trial.labels) if any(part in label.lower() for part in PELVIS)]
    if not of_it:
        raise NoPlaceError("no marker is named after the pelvis")
    middle = trial.positions[:, of_it].mean(axis=1)
    seen = np.isfinite(middle).all(axis=1)
    return np.stack([np.interp(trial.force_times, trial.times[seen], x) for x in middle[seen].T], axis=1)


def _pull(pelvis: np.ndarray, stiffness_N_m: float, slack_m: float, behind_m: float) -> np.ndarray:
    """On the person (samples, 3) [N]."""
    way = pelvis[-1] - pelvis[0]
    way[1] = 0.0
    length = np.linalg.norm(way)
    forward = way / length if length > 0.3 else np.array([1.0, 0.0, 0.0])
    anchor = pelvis.mean(axis=0) - behind_m * forward
    line = anchor - pelvis
    distance = np.linalg.norm(line, axis=1, keepdims=True)
    return stiffness_N_m * np.maximum(distance - slack_m, 0.0) * line / distance


def _felt(trial: Trial, at: np.ndarray, pull: np.ndarray) -> Trial:
    """What the ground gives less: the pull and its moment, on each plate by its share of the load."""
    total = np.maximum(loads_of(trial), 1.0)
    plates = []
    for plate in trial.plates:
        share = (plate.force[:, 1] / total * (total > 100.0))[:, None]
        plates.append(
            replace(
                plate,
                force=plate.force - share * pull,
                moment=plate.moment - share * np.cross(at, pull),
            )
        )
    return replace(trial, plates=tuple(plates))
