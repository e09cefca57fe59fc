"""Faults of what was entered, and forces on the person that no plate measures."""

from dataclasses import replace

import numpy as np

from benchmarks.faults.editor.fault import Edit, Fault, NoPlaceError
from benchmarks.faults.editor.plates import loads_of
from benchmarks.faults.editor.recording import Recording, Trial

PELVIS = ("asi", "psi", "sacr")  # parts of markers' names, in small letters


def somebody_elses_mass(factor: float) -> Edit:
    """The mass that was entered is another person's."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        if recording.mass_kg is None:
            raise NoPlaceError("no mass entered")
        entered = round(factor * recording.mass_kg, 1)
        what = f"{entered} kg were entered in place of {recording.mass_kg} kg"
        fault = Fault(what, {"mass_factor": 1 / factor}, tuple(t.name for t in recording.trials))
        return replace(recording, mass_kg=entered), fault

    return edit


def supported(share: float) -> Edit:
    """A harness at the pelvis carries a share of the weight all along, straight up; the plates feel less.

    Force and moment: what the ground gives is what the motion asks for less what the harness gives *at the
    pelvis*. Taken off at the pressures instead, the force would act there, as a lighter body's weight does.
    """

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        if recording.mass_kg is None:
            raise NoPlaceError("no mass entered")
        lift_N = share * recording.mass_kg * 9.80665
        trials = []
        for trial in recording.trials:
            if loads_of(trial).min() < 1.5 * lift_N:
                raise NoPlaceError("there is flight: the harness would pull the feet off")
            lift = np.tile([0.0, lift_N, 0.0], (len(trial.force_times), 1))
            trials.append(felt(trial, pelvis(trial), lift))
        names = tuple(t.name for t in trials)
        fault = Fault(f"a harness carries {lift_N:.0f} N", {"force_N": lift_N}, names)
        return replace(recording, trials=tuple(trials)), fault

    return edit


def pelvis(trial: Trial) -> np.ndarray:
    """Its markers' middle at the forces' times (samples, 3) [m]."""
    of_it = [k for k, label in enumerate(trial.labels) if any(part in label.lower() for part in PELVIS)]
    if not of_it:
        raise NoPlaceError("no marker is named after the pelvis")
    middle = trial.positions[:, of_it].mean(axis=1)
    seen = np.isfinite(middle).all(axis=1)
    return np.stack([np.interp(trial.force_times, trial.times[seen], x) for x in middle[seen].T], axis=1)


def felt(trial: Trial, at: np.ndarray, pull: np.ndarray) -> Trial:
    """What the ground gives less: the pull and its moment, on each plate by its share of the load.

    Args:
        trial: as it was recorded.
        at: where the pull acts, one row a sample of the forces [m].
        pull: on the person, likewise [N].
    """
    total = np.maximum(loads_of(trial), 1.0)
    plates = []
    for plate in trial.plates:
        share = (plate.force[:, 1] / total * (total > 100.0))[:, None]
        moment = plate.moment - share * np.cross(at, pull)
        plates.append(replace(plate, force=plate.force - share * pull, moment=moment))
    return replace(trial, plates=tuple(plates))
