"""All witnesses, asked in their order."""

from collections.abc import Sequence

from solver.capture.capture import Capture
from solver.capture.reading_settings import ReadingSettings
from solver.diagnosis.witnesses.contact_edges import contact_edges
from solver.diagnosis.witnesses.empty_plate import empty_plate
from solver.diagnosis.witnesses.exchange import exchange
from solver.diagnosis.witnesses.lag import lag
from solver.diagnosis.witnesses.levels import levels
from solver.diagnosis.witnesses.measured import measured
from solver.diagnosis.witnesses.pressure_path import pressure_path
from solver.diagnosis.witnesses.rigid_distances import rigid_distances
from solver.diagnosis.witnesses.settings import WITNESSES, WitnessSettings
from solver.diagnosis.witnesses.standing import standing
from solver.diagnosis.witnesses.statement import Statement
from solver.diagnosis.witnesses.weight import weight


def asked(
    captures: Sequence[Capture],
    entered_kg: float | None,
    reading: ReadingSettings,
    settings: WitnessSettings = WITNESSES,
) -> tuple[Statement, ...]:
    """What measured data say by themselves, before any cause is looked for and without a model of the body.

    Args:
        captures: trials of one person, as read.
        entered_kg: the person's mass, if somebody entered it.
        reading: as the captures were read with.
        settings: what the witnesses know beforehand.
    """
    trials = measured(captures, reading, settings)
    if not trials:
        return ()
    return (
        *weight(trials, entered_kg),
        *lag(trials),
        *contact_edges(trials),
        *levels(trials, entered_kg),
        *empty_plate(trials),
        *exchange(trials),
        *standing(trials),
        *pressure_path(trials),
        *rigid_distances(trials),
    )
