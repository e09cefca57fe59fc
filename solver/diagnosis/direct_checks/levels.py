"""Signs and zero levels: what reading decides by weight and motion, and what an empty plate reads."""

from collections.abc import Sequence

import numpy as np

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import fill_gaps
from solver.capture.plates.plate_levels import evidence_on_plates
from solver.capture.plates.zero_level import unloaded_stretches
from solver.common.true_runs import runs
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import MOST_NATS, About, Statement, nats_of

LEVELS, EMPTY = "signs and zero levels", "empty plate"
EMPTY_SCATTER_N = 4.0  # what a tare leaves, and ringing of filters
EMPTY_USUAL_N = 30.0  # untared plates; larger levels are taken off and told when files are read


def levels(trials: Sequence[Measured], entered_kg: float | None) -> list[Statement]:
    """Each used plate of each trial, as it was left by reading."""
    said = []
    for trial in trials:
        plates, reading = trial.capture.plates, trial.reading
        direct_checks = evidence_on_plates(plates, trial.capture.markers, entered_kg, reading.conditioning)
        for k, found in enumerate(direct_checks, start=1):
            if not found.used:
                continue
            turned = min(found.sign_nats, MOST_NATS) * (1 if found.sign < 0 else -1)
            untared = min(found.zero_nats, MOST_NATS) if found.zero_N else -1.0
            said.append(
                Statement(
                    LEVELS,
                    f"{plates[k - 1].name}: {found.sentence()}.",
                    {About.PLATE_SIGN: turned, About.PLATE_ZERO: untared},
                    {"zero_N": found.zero_N, "sign": float(found.sign)},
                    trial=trial.capture.name,
                    target=f"plate_{k}",
                )
            )
    return said


def empty_plate(trials: Sequence[Measured]) -> list[Statement]:
    """Plates that are empty for a while and whose empty samples no program set to zero."""
    said = []
    for trial in trials:
        for k, plate in enumerate(trial.capture.plates, start=1):
            whole, recorded, _ = fill_gaps(plate, trial.reading.conditioning)
            empty = unloaded_stretches(whole, trial.reading.conditioning) & recorded
            if not empty.any():
                continue
            off_N = 0.0 if plate.zero_ground is None else plate.zero_ground[:3]
            said.append(_of_plate(trial, k, plate, [off_N + whole.force_ground[a:b] for a, b in runs(empty)]))
    return said


def _of_plate(trial: Measured, k: int, plate: ForcePlate, stretches: list[np.ndarray]) -> Statement:
    level = np.median(np.concatenate(stretches), axis=0)
    size = float(np.linalg.norm(level))
    drift = float(np.median(stretches[-1][:, 1]) - np.median(stretches[0][:, 1]))
    seconds = sum(map(len, stretches)) / plate.rate
    nats = nats_of(size, 0.0, EMPTY_SCATTER_N, EMPTY_USUAL_N)
    drifts = f", {abs(drift):.0f} N more at the end" if abs(drift) > EMPTY_SCATTER_N else ""
    return Statement(
        EMPTY,
        f"{plate.name} reads {size:.0f} N while nobody is on it ({seconds:.1f} s{drifts}; normal: "
        "below 8 N).",
        {About.PLATE_ZERO: nats, About.LOAD: nats},
        {"x_N": float(level[0]), "y_N": float(level[1]), "z_N": float(level[2]), "drift_y_N": drift},
        trial=trial.capture.name,
        target=f"plate_{k}",
    )
