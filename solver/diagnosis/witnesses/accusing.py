"""Plates that witnesses accuse: so wrong that nothing else can be told of the recording before that."""

from collections.abc import Sequence

from solver.diagnosis.witnesses.levels import WITNESS as LEVELS
from solver.diagnosis.witnesses.settings import WITNESSES, WitnessSettings
from solver.diagnosis.witnesses.statement import About, Statement

GROSS = (About.PLATE_TURN, About.PLATE_PLACE, About.PLATE_SIGN)


def accused_plates(statements: Sequence[Statement], settings: WitnessSettings = WITNESSES) -> frozenset[str]:
    """Their targets; none while the clocks are in doubt: a foot that moves on has left its pressure behind.

    Two plates are not out of place at once: pressures that lie beside the soles on all of them say that
    soles or cameras are off, or that plates bear next to nothing, as under feet of somebody who sits.

    Args:
        statements: of all witnesses.
        settings: from where on a plate is accused.
    """
    if any(About.CLOCK in one.spoken_for(settings.told_nats) for one in statements):
        return frozenset()
    own = [one for one in statements if one.target is not None and "+" not in one.target]
    placed = {one.target for one in own if About.PLATE_PLACE in one.nats}
    accused = {
        about: {str(one.target) for one in own if one.nats.get(about, 0.0) >= settings.accusing_nats}
        for about in GROSS
    }
    if len(placed) > 1 and accused[About.PLATE_PLACE] == placed:
        del accused[About.PLATE_PLACE]
    return frozenset[str]().union(*accused.values(), _untared(own, settings))


def _untared(statements: Sequence[Statement], settings: WitnessSettings) -> set[str]:
    """Plates whose zero level is off while their sign is clear, and which reading could not put right."""
    said = [one for one in statements if one.witness == LEVELS]
    return {
        str(one.target)
        for one in said
        if one.nats.get(About.PLATE_ZERO, 0.0) >= settings.accusing_nats
        and one.nats.get(About.PLATE_SIGN, 0.0) <= -settings.accusing_nats
    }
