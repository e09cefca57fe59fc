"""All direct checks, asked in their order, and the plates that they suspect."""

from collections.abc import Sequence
from dataclasses import replace

from solver.diagnosis.direct_checks.lag import contact_edges, lag
from solver.diagnosis.direct_checks.levels import EMPTY, LEVELS, empty_plate, levels
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.pressure_path import pressure_path, standing
from solver.diagnosis.direct_checks.rigid_distances import rigid_distances
from solver.diagnosis.direct_checks.statement import STATED_NATS, About, Statement
from solver.diagnosis.direct_checks.weight import exchange, weight

SUSPECTING_NATS = 6.0  # 400 to 1: from here on nothing else is named; a plate that is 19 cm off has as much

BY_A_LAG = frozenset(a for a in About if a.startswith("plate_")) | {About.OFF_PLATE}
GROSS = (About.PLATE_TURN, About.PLATE_PLACE, About.PLATE_SIGN)


def run_checks(trials: Sequence[Measured], entered_kg: float | None) -> tuple[Statement, ...]:
    """What measured data say by themselves, before any cause is looked for and without a model of the body.

    Args:
        trials: of one person, as recorded.
        entered_kg: the person's mass, if somebody entered it.
    """
    if not trials:
        return ()
    return _beside_a_lag(
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


def _beside_a_lag(*said: Statement) -> tuple[Statement, ...]:
    """Statements that no longer speak for what clocks explain, once those are told to differ.

    A foot that moved on has left its pressure behind: its plate seems to be elsewhere, or turned, and bears
    what another one bore. Of an empty plate no clock says anything.
    """
    late = {one.trial for one in said if About.CLOCK in one.spoken_for(STATED_NATS)}
    if not late:
        return said
    return tuple(
        replace(one, nats={a: min(n, 0.0) if a in BY_A_LAG else n for a, n in one.nats.items()})
        if one.direct_check != EMPTY and (one.trial in late or one.trial is None)
        else one
        for one in said
    )


def suspect_plates(statements: Sequence[Statement]) -> frozenset[str]:
    """Plates so wrong that nothing else can be told of the recording before that.

    None while the clocks are in doubt: a foot that moves on has left its pressure behind. Two plates are not
    out of place at once: pressures that lie beside the soles on all of them say that soles or cameras are
    off, or that plates bear next to nothing, as under feet of somebody who sits.

    Args:
        statements: of all direct checks.
    """
    if any(About.CLOCK in one.spoken_for(STATED_NATS) for one in statements):
        return frozenset()
    own = [one for one in statements if one.target is not None and "+" not in one.target]
    placed = {one.target for one in own if About.PLATE_PLACE in one.nats}
    out_of_place = {one.target for one in own if one.nats.get(About.PLATE_PLACE, 0.0) > 0}
    suspect = {
        about: {str(one.target) for one in own if one.nats.get(about, 0.0) >= SUSPECTING_NATS}
        for about in GROSS
    }
    if len(placed) > 1 and out_of_place == placed:
        del suspect[About.PLATE_PLACE]
    return frozenset[str]().union(*suspect.values(), _untared(own))


def _untared(statements: Sequence[Statement]) -> set[str]:
    """Plates whose zero level is off while their sign is clear, and which reading could not corrected."""
    said = [one for one in statements if one.direct_check == LEVELS]
    return {
        str(one.target)
        for one in said
        if one.nats.get(About.PLATE_ZERO, 0.0) >= SUSPECTING_NATS
        and one.nats.get(About.PLATE_SIGN, 0.0) <= -SUSPECTING_NATS
    }
