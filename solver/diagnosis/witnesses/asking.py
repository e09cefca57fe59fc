"""All witnesses, asked in their order."""

from collections.abc import Sequence

from solver.diagnosis.witnesses.contact_edges import contact_edges
from solver.diagnosis.witnesses.empty_plate import empty_plate
from solver.diagnosis.witnesses.exchange import exchange
from solver.diagnosis.witnesses.lag import lag
from solver.diagnosis.witnesses.levels import levels
from solver.diagnosis.witnesses.measured import Measured
from solver.diagnosis.witnesses.pressure_path import pressure_path
from solver.diagnosis.witnesses.rigid_distances import rigid_distances
from solver.diagnosis.witnesses.standing import standing
from solver.diagnosis.witnesses.statement import Statement
from solver.diagnosis.witnesses.weight import weight


def asked(trials: Sequence[Measured], entered_kg: float | None) -> tuple[Statement, ...]:
    """What measured data say by themselves, before any cause is looked for and without a model of the body.

    Args:
        trials: of one person, as recorded.
        entered_kg: the person's mass, if somebody entered it.
    """
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
