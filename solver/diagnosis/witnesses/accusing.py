"""Plates that witnesses accuse: so wrong that nothing else can be told of the recording before that."""

from collections.abc import Sequence

from solver.diagnosis.witnesses.settings import WITNESSES, WitnessSettings
from solver.diagnosis.witnesses.statement import About, Statement

GROSS = (
    About.PLATE_TURN,
    About.PLATE_PLACE,
    About.PLATE_SIGN,
)  # a zero level is told and taken off on reading


def accused_plates(statements: Sequence[Statement], settings: WitnessSettings = WITNESSES) -> frozenset[str]:
    """Their targets; none while the clocks are in doubt: a foot that moves on has left its pressure behind.

    Args:
        statements: of all witnesses.
        settings: from where on a plate is accused.
    """
    if any(About.CLOCK in one.spoken_for(settings.told_nats) for one in statements):
        return frozenset()
    return frozenset(
        one.target
        for one in statements
        if one.target is not None
        and "+" not in one.target
        and any(one.nats.get(about, 0.0) >= settings.accusing_nats for about in GROSS)
    )
