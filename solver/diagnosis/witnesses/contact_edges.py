"""Edges of contacts: how much of a step's force is quick, 10 to 20 Hz, against what is slow, 2 to 6 Hz.

Feet strike and leave within some hundredths of a second whatever the person does in between, and a low-pass
at 4 to 6 Hz takes nearly all of that away: by ten times in a walk. Shorter contacts are as much quicker.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfiltfilt

from solver.capture.conditioning import gaps_filled
from solver.diagnosis.witnesses.measured import Measured
from solver.diagnosis.witnesses.statement import About, Statement, nats_of
from solver.runs import runs

WITNESS = "edges of contacts"
QUICK_HZ, SLOW_HZ = (10.0, 20.0), (2.0, 6.0)
LEAST_S = 0.08  # a contact
LEAST_RECORDED_S = 0.8  # shorter recordings hold too little that is slow


def contact_edges(trials: Sequence[Measured]) -> list[Statement]:
    """Each trial, over all contacts that begin and end in it."""
    return [said for trial in trials if (said := _of_trial(trial)) is not None]


def _of_trial(trial: Measured) -> Statement | None:
    settings = trial.settings
    ratios, lengths = [], []
    for plate in trial.capture.plates:
        whole, _, _ = gaps_filled(plate, trial.reading.conditioning)
        force = whole.force_ground[:, 1]
        if plate.rate < 2.5 * QUICK_HZ[1] or len(force) < LEAST_RECORDED_S * plate.rate:
            continue
        peak = float(force.max())
        own = [
            (end - start) / plate.rate
            for start, end in runs(force > 0.05 * peak)
            if start > 0 and end < len(force) and end - start > LEAST_S * plate.rate
        ]
        if peak < 10 * settings.loaded_N or not own:
            continue
        ratios.append(_size(force, plate.rate, QUICK_HZ) / max(_size(force, plate.rate, SLOW_HZ), 1e-9))
        lengths.append(float(np.median(own)))
    if not ratios:
        return None
    usual = settings.quick_share_s / float(np.median(lengths))
    share = float(np.median(ratios))
    figure = math.log(max(share, 1e-6) / usual)
    nats = nats_of(figure, 0.0, settings.quick_scatter, settings.quick_usual) if figure < 0 else -1.0
    return Statement(
        WITNESS,
        f"The fast part of the forces ({QUICK_HZ[0]:.0f} to {QUICK_HZ[1]:.0f} Hz) is {100 * share:.1f} % of "
        f"the slow part; {100 * usual:.1f} % is usual for contacts of this length (normal: at least a "
        "quarter of that).",
        {About.FILTER: nats},
        {"quick_share": share, "usual_share": usual},
        trial=trial.capture.name,
    )


def _size(force: np.ndarray, rate: float, band_Hz: tuple[float, float]) -> float:
    sections = butter(3, band_Hz, "bandpass", fs=rate, output="sos")
    return float(np.std(sosfiltfilt(sections, force)))
