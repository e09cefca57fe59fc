"""All witnesses, asked in their order, and the plates that they accuse."""

from collections.abc import Sequence

from solver.diagnosis.witnesses.contact_edges import contact_edges
from solver.diagnosis.witnesses.empty_plate import empty_plate
from solver.diagnosis.witnesses.exchange import exchange
from solver.diagnosis.witnesses.lag import lag
from solver.diagnosis.witnesses.levels import WITNESS as LEVELS
from solver.diagnosis.witnesses.levels import levels
from solver.diagnosis.witnesses.measured import Measured
from solver.diagnosis.witnesses.pressure_path import pressure_path
from solver.diagnosis.witnesses.rigid_distances import rigid_distances
from solver.diagnosis.witnesses.settings import WITNESSES, WitnessSettings
from solver.diagnosis.witnesses.standing import standing
from solver.diagnosis.witnesses.statement import About, Statement
from solver.diagnosis.witnesses.weight import weight

GROSS = (About.PLATE_TURN, About.PLATE_PLACE, About.PLATE_SIGN)


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


def accused_plates(statements: Sequence[Statement], settings: WitnessSettings = WITNESSES) -> frozenset[str]:
    """Plates so wrong that nothing else can be told of the recording before that.

    None while the clocks are in doubt: a foot that moves on has left its pressure behind. Two plates are not
    out of place at once: pressures that lie beside the soles on all of them say that soles or cameras are
    off, or that plates bear next to nothing, as under feet of somebody who sits.

    Args:
        statements: of all witnesses.
        settings: from where on a plate is accused.
    """
    if any(About.CLOCK in one.spoken_for(settings.told_nats) for one in statements):
        return frozenset()
    own = [one for one in statements if one.target is not None and "+" not in one.target]
    placed = {one.target for one in own if About.PLATE_PLACE in one.nats}
    out_of_place = {one.target for one in own if About.PLATE_PLACE in one.spoken_for(settings.told_nats)}
    accused = {
        about: {str(one.target) for one in own if one.nats.get(about, 0.0) >= settings.accusing_nats}
        for about in GROSS
    }
    if len(placed) > 1 and out_of_place == placed:
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
