"""Faults of what was entered, and forces on the person that no plate measures."""

from dataclasses import replace

import numpy as np

from benchmarks.faults.editor.fault import Edit, Fault, NoPlaceError
from benchmarks.faults.editor.plates import loads_of
from benchmarks.faults.editor.recording import Recording


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
    """A harness carries a share of the weight all along; the plates feel so much less, each by its load."""

    def edit(recording: Recording, rng: np.random.Generator) -> tuple[Recording, Fault]:
        if recording.mass_kg is None:
            raise NoPlaceError("no mass entered")
        lift_N = share * recording.mass_kg * 9.80665
        trials = []
        for trial in recording.trials:
            total = loads_of(trial)
            if total.min() < 1.5 * lift_N:
                raise NoPlaceError("there is flight: the harness would pull the feet off")
            plates = []
            for plate in trial.plates:
                less = plate.force[:, 1] * lift_N / total
                taken = np.stack([0 * less, less, 0 * less], axis=1)
                moment = plate.moment - np.cross(plate.pressure, taken)
                plates.append(replace(plate, force=plate.force - taken, moment=moment))
            trials.append(replace(trial, plates=tuple(plates)))
        names = tuple(t.name for t in trials)
        fault = Fault(f"a harness carries {lift_N:.0f} N", {"force_N": lift_N}, names)
        return replace(recording, trials=tuple(trials)), fault

    return edit
