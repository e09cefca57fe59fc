"""Signs and zero levels of the plates, by weight and motion: the verdict that reading makes, as evidence."""

from collections.abc import Sequence

from solver.capture.plates.plate_levels import evidence_on_plates
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.statement import MOST_NATS, About, Statement

DIRECT_CHECK = "signs and zero levels"


def levels(trials: Sequence[Measured], entered_kg: float | None) -> list[Statement]:
    """Each used plate of each trial, as it was left by reading."""
    said = []
    for trial in trials:
        plates, reading = trial.capture.plates, trial.reading
        direct_checks = evidence_on_plates(
            plates, trial.capture.markers, entered_kg, reading.plate_signs, reading.conditioning
        )
        for k, found in enumerate(direct_checks, start=1):
            if not found.used:
                continue
            turned = min(found.sign_nats, MOST_NATS) * (1 if found.sign < 0 else -1)
            untared = min(found.zero_nats, MOST_NATS) if found.zero_N else -1.0
            said.append(
                Statement(
                    DIRECT_CHECK,
                    f"{plates[k - 1].name}: {found.sentence(reading.plate_signs)}.",
                    {About.PLATE_SIGN: turned, About.PLATE_ZERO: untared},
                    {"zero_N": found.zero_N, "sign": float(found.sign)},
                    trial=trial.capture.name,
                    target=f"plate_{k}",
                )
            )
    return said
