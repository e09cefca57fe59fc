"""All direct checks, asked in their order, those of levels among them, and the plates that they suspect."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.capture.capture import ForcePlate
from solver.capture.plates.conditioning import fill_gaps
from solver.capture.plates.plate_levels import evidence_on_plates
from solver.capture.plates.zero_level import unloaded_stretches
from solver.common.true_runs import runs
from solver.diagnosis.direct_checks.lag import contact_edges, lag
from solver.diagnosis.direct_checks.measured import Measured
from solver.diagnosis.direct_checks.pressure_path import pressure_path, standing
from solver.diagnosis.direct_checks.rigid_distances import rigid_distances
from solver.diagnosis.direct_checks.statement import MOST_NATS, STATED_NATS, About, Statement, nats_of
from solver.diagnosis.direct_checks.weight import exchange, weight

SUSPECTING_NATS = 6.0  # 400 to 1: from here on nothing else is named; a plate that is 19 cm off has as much

BY_A_LAG = frozenset(a for a in About if a.startswith("plate_")) | {About.OFF_PLATE}
GROSS = (About.PLATE_TURN, About.PLATE_PLACE, About.PLATE_SIGN)
LEVELS, EMPTY = "signs and zero levels", "empty plate"
EMPTY_SCATTER_N = 4.0  # what a tare leaves, and ringing of filters
EMPTY_USUAL_N = 30.0  # untared plates; larger levels are taken off and told when files are read


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
