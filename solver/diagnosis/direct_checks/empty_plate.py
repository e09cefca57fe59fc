"""Empty plate: what a plate reads while nobody is on it, and whether that drifts."""

from collections.abc import Sequence

import numpy as np

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import gaps_filled
from solver.capture.plates.zero_level import unloaded_stretches
from solver.common.runs import runs
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of

DIRECT_CHECK = "empty plate"


def empty_plate(trials: Sequence[Measured]) -> list[Statement]:
    """Plates that are empty for a while and whose empty samples no program set to zero."""
    said = []
    for trial in trials:
        for k, plate in enumerate(trial.capture.plates, start=1):
            whole, recorded, _ = gaps_filled(plate, trial.reading.conditioning)
            empty = unloaded_stretches(whole, trial.reading.conditioning) & recorded
            if not empty.any():
                continue
            off_N = 0.0 if plate.zero_ground is None else plate.zero_ground[:3]
            said.append(_of_plate(trial, k, plate, [off_N + whole.force_ground[a:b] for a, b in runs(empty)]))
    return said


def _of_plate(trial: Measured, k: int, plate: ForcePlate, stretches: list[np.ndarray]) -> Statement:
    settings = trial.settings
    level = np.median(np.concatenate(stretches), axis=0)
    size = float(np.linalg.norm(level))
    drift = float(np.median(stretches[-1][:, 1]) - np.median(stretches[0][:, 1]))
    seconds = sum(map(len, stretches)) / plate.rate
    nats = nats_of(size, 0.0, settings.empty_scatter_N, settings.empty_usual_N)
    drifts = f", {abs(drift):.0f} N more at the end" if abs(drift) > settings.empty_scatter_N else ""
    return Statement(
        DIRECT_CHECK,
        f"{plate.name} reads {size:.0f} N while nobody is on it ({seconds:.1f} s{drifts}; normal: "
        "below 8 N).",
        {About.PLATE_ZERO: nats, About.LOAD: nats},
        {"x_N": float(level[0]), "y_N": float(level[1]), "z_N": float(level[2]), "drift_y_N": drift},
        trial=trial.capture.name,
        target=f"plate_{k}",
    )
